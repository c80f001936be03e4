// The filter bar, and the figures that follow it: a path with `data-presses` draws one piece for each of them.
(() => {
  const { $, $$, C, total, rowOf, el, shape, filter } = report;
  const form = $('#filters');
  const inputs = $$('[data-filter]', form);
  for (const input of inputs) {
    const column = input.dataset.filter;
    if (input.tagName === 'SELECT') {
      const values = [...new Set(C[column])].sort((a, b) => typeof a === 'number' ? a - b : a < b ? -1 : 1);
      for (const v of values) { const option = el('option', String(v)); option.value = String(v); input.append(option); }
    }
    // A reload may bring earlier choices back.
    const apply = () => filter.set(column, input.dataset.name, input.value);
    input.addEventListener('input', apply);
    if (input.value !== '') apply();
  }
  form.addEventListener('submit', e => e.preventDefault());
  form.addEventListener('reset', () => { for (const input of inputs) filter.set(input.dataset.filter, input.dataset.name, ''); });
  filter.follow(() => {
    let n = 0;
    for (let i = 0; i < total; i++) if (filter.passes(i)) n++;
    form.classList.toggle('active', filter.active());
    $('#filter-state').textContent = n === 0 ? 'no press matches' : filter.active() ? `${n} of ${total} presses` : `all ${total} presses`;
    $('#filter-words').textContent = filter.active() ? `Filtered by ${filter.words()}: ${n} of ${total} presses.` : '';
  });

  // "3-83 85": runs of press numbers, as they stand in the figures.
  const numbers = runs => runs.split(' ').filter(Boolean).flatMap(run => {
    const [from, to = from] = run.split('-').map(Number);
    return Array.from({ length: to - from + 1 }, (_, k) => from + k);
  });
  const passes = press => filter.passes(rowOf.get(press));
  const say = (figure, shown, all) => {
    const foot = $('.count', figure);
    foot.dataset.all ??= foot.textContent;
    foot.textContent = filter.active() ? `${shown} of ${all} drawn presses · ${filter.words()}` : foot.dataset.all;
  };
  for (const figure of $$('.fig').filter(f => $('[data-presses]', f))) {
    const paths = $$('[data-presses]', figure).map(path => ({
      path, whole: path.getAttribute('d'), pieces: path.getAttribute('d').split(/(?=M)/), presses: numbers(path.dataset.presses),
    }));
    const all = new Set(paths.flatMap(p => p.presses)).size;
    filter.follow(() => {
      const shown = new Set();
      for (const { path, whole, pieces, presses } of paths) {
        path.setAttribute('d', filter.active() ? pieces.filter((_, k) => passes(presses[k])).join('') : whole);
        for (const press of presses) if (passes(press)) shown.add(press);
      }
      say(figure, shown.size, all);
    });
  }

  // Presses behind the headline; their errors in order.
  const counted = [...Array(total).keys()].filter(i => C.counted[i]);
  const errors = () => counted.filter(filter.passes).map(i => C.error_mm[i]).sort((a, b) => a - b);

  // The discs of the map: mean error of the presses that pass, in the colours of the scale beside them.
  const discs = $('#skin-map .locations');
  const scale = $$('#skin-map .colour-bar rect').map(r => r.getAttribute('fill'));
  const places = $$('circle', discs).map(disc => ({ disc, fill: disc.getAttribute('fill'), location: Number(disc.dataset.location) }));
  filter.follow(() => {
    const sums = new Map();
    for (const i of counted.filter(filter.passes)) {
      const [sum, n] = sums.get(C.location[i]) ?? [0, 0];
      sums.set(C.location[i], [sum + C.error_mm[i], n + 1]);
    }
    for (const { disc, fill, location } of places) {
      const [sum, n] = sums.get(location) ?? [0, 0];
      disc.classList.toggle('off-layer', n === 0);
      const step = Math.floor(sum / n / Number(discs.dataset.end) * scale.length);
      disc.setAttribute('fill', filter.active() && n ? scale[Math.min(step, scale.length - 1)] : fill);
    }
  });

  // Distribution of the errors: bars and steps of those that pass, on the axes of all.
  const spread = $('#error-distribution');
  const [shares, counts] = $$('.plot', spread);
  const [x, share, count] = [[shares, 'x'], [shares, 'y'], [counts, 'y']].map(([plot, name]) => report.axis(plot, name));
  const bars = $('.bars', spread);
  const width = Number(bars.dataset.bin);
  const steps = $('.ecdf', spread);
  if (steps) {
    const whole = { bars: [...bars.children], steps: steps.getAttribute('d') };
    filter.follow(() => {
      const e = errors();
      say(spread, e.length, counted.length);
      if (!filter.active()) {
        bars.replaceChildren(...whole.bars);
        steps.setAttribute('d', whole.steps);
        return;
      }
      const bins = new Map();
      for (const mm of e) bins.set(Math.floor(mm / width), (bins.get(Math.floor(mm / width)) ?? 0) + 1);
      bars.replaceChildren(...[...bins].map(([k, n]) => shape('rect', { x: x.at(k * width), y: count.at(n), width: x.at(width) - x.at(0), height: count.at(0) - count.at(n) })));
      const up = k => share.at(100 * k / e.length);
      steps.setAttribute('d', e.length ? `M${x.at(0)} ${share.at(0)}` + e.map((mm, k) => `H${x.at(mm)}V${up(k + 1)}`).join('') : '');
    });
  }
})();
