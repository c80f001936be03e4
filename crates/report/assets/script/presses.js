// The press table: what the filter lets through, sorted, one page at a time.
(() => {
  const { $, $$, C, total, text, el, filter } = report;
  const PAGE = 50;
  const columns = [
    ['press', 'press', 0], ['role', 'role'], ['repetition', 'rep.', 0], ['location', 'location', 0], ['depth_mm', 'depth (mm)', 2], ['verdict', 'verdict'], ['outcome', 'outcome'],
    ['truth_x_mm', 'truth x (mm)', 2], ['truth_y_mm', 'truth y (mm)', 2], ['estimate_x_mm', 'estimate x (mm)', 2], ['estimate_y_mm', 'estimate y (mm)', 2],
    ['error_mm', 'error (mm)', 2], ['camera1_events', 'events 1', 0], ['camera2_events', 'events 2', 0],
    ['camera1_clusters', 'clusters 1', 0], ['camera2_clusters', 'clusters 2', 0],
    ['camera1_centroid_u_px', 'u 1 (px)', 1], ['camera2_centroid_u_px', 'u 2 (px)', 1], ['reason', 'reason'],
  ];
  const pressTable = $('#press-table');
  const body = $('tbody', pressTable);
  let sort = { key: 'press', down: false };
  let page = 0;
  let rows = [];
  const headRow = el('tr');
  for (const [key, name] of columns) {
    const th = el('th');
    th.scope = 'col';
    th.dataset.key = key;
    const button = el('button', name);
    button.type = 'button';
    button.addEventListener('click', () => { sort = { key, down: sort.key === key && !sort.down }; page = 0; refresh(); });
    th.append(button);
    headRow.append(th);
  }
  $('thead', pressTable).append(headRow);
  const refresh = () => {
    rows = [...Array(total).keys()].filter(filter.passes);
    const c = C[sort.key];
    const sign = sort.down ? -1 : 1;
    rows.sort((a, b) => {
      if (c[a] === c[b]) return a - b;
      if (c[a] === null) return 1;
      if (c[b] === null) return -1;
      return sign * (c[a] < c[b] ? -1 : 1);
    });
    for (const th of headRow.children) {
      const mine = th.dataset.key === sort.key;
      if (mine) th.setAttribute('aria-sort', sort.down ? 'descending' : 'ascending'); else th.removeAttribute('aria-sort');
      const button = th.firstChild;
      button.textContent = button.textContent.replace(/ [▲▼]$/, '') + (mine ? (sort.down ? ' ▼' : ' ▲') : '');
    }
    show();
  };
  const show = () => {
    const pages = Math.max(1, Math.ceil(rows.length / PAGE));
    page = Math.min(Math.max(page, 0), pages - 1);
    body.replaceChildren(...rows.slice(page * PAGE, (page + 1) * PAGE).map(i => {
      const tr = el('tr');
      for (const [key, , digits] of columns) {
        const value = C[key][i];
        if (key === 'press') {
          const th = el('th');
          const button = el('button', text(value));
          th.scope = 'row';
          button.type = 'button';
          button.setAttribute('aria-label', `Show press ${value}`);
          th.append(button);
          tr.append(th);
          continue;
        }
        const td = el('td', value === null && digits === undefined ? '' : text(value, digits), digits === undefined ? (key === 'reason' ? 'reason' : '') : 'num');
        if (key === 'verdict') td.prepend(el('i', '', 'key ' + (/^[a-z]+$/.test(value) ? value : '')));
        tr.append(td);
      }
      tr.addEventListener('click', () => {
        for (const other of body.children) other.removeAttribute('aria-selected');
        tr.setAttribute('aria-selected', 'true');
        report.keep(i);
      });
      return tr;
    }));
    $('#page-state').textContent = rows.length ? `${page * PAGE + 1} to ${Math.min((page + 1) * PAGE, rows.length)} of ${rows.length} presses` : 'no press matches';
    $('[data-page="-1"]').disabled = page === 0;
    $('[data-page="1"]').disabled = page === pages - 1;
  };
  for (const b of $$('[data-page]')) b.addEventListener('click', () => { page += Number(b.dataset.page); show(); });
  filter.follow(() => { page = 0; refresh(); });
})();
