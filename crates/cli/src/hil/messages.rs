//! Messages about a night: its verdict, and the trend alarms that it raised.

use skinrig_hil::night_folder::{self, NightFolder};
use skinrig_model::Notification;
use skinrig_nightly::Night;
use skinrig_notify::{Notifier, RaisedAlarms, Subject};

use super::trend::NightTrends;
use crate::notify;

/// Sends the messages about `night` and waits for results, at most for the grace. `after` holds the trends up to it.
pub(super) fn send(
    mut notifier: Notifier,
    night: &Night,
    folder: &NightFolder,
    after: Option<&NightTrends>,
) -> Vec<Notification> {
    let home = notify::absolute(folder.path());
    let golden = night.golden.as_ref();
    let golden = golden.map(|golden| home.join(&golden.session));
    let subject = Subject::Night {
        night,
        page: &home.join(night_folder::PAGE),
        golden: golden.as_deref(),
    };
    notify::post(&mut notifier, &night.rig, subject);
    if let Some(after) = after.filter(|after| after.raised > 0) {
        let session = after.raised_session.as_deref().map(notify::absolute);
        let subject = Subject::Alarms(RaisedAlarms {
            night,
            headline: &after.report.headline,
            raised: after.raised,
            page: &home.join(night_folder::TRENDS),
            session: session.as_deref(),
        });
        notify::post(&mut notifier, &night.rig, subject);
    }
    let notifications = notify::finish(notifier);
    for notification in &notifications {
        errln!("{}", notify::line(notification));
    }
    notifications
}
