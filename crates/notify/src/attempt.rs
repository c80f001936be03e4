//! One channel, and the tries to send a message on it.

use std::time::Duration;

use skinrig_model::{NotificationChannel, NotificationFault};

use crate::clock::Clock;
use crate::message::Message;
use crate::policy::Policy;

/// A way to send messages.
pub trait Channel: Send {
    /// Its name.
    fn name(&self) -> NotificationChannel;

    /// Tries once.
    ///
    /// # Errors
    /// [`NotificationFault`] if the receiver did not accept the message.
    fn send(&mut self, message: &Message) -> Result<(), NotificationFault>;
}

/// Tries until the message is accepted, the fault is final, the tries are used up or `is_over`. Returns the number of tries, and the
/// fault of the last one.
pub(crate) fn deliver(
    channel: &mut dyn Channel,
    message: &Message,
    policy: Policy,
    clock: &dyn Clock,
    is_over: &dyn Fn() -> bool,
) -> (u32, Option<NotificationFault>) {
    let mut wait = policy.backoff;
    for number in 1.. {
        match channel.send(message) {
            Ok(()) => return (number, None),
            Err(fault) if number >= policy.tries || !fault.is_transient() || is_over() => {
                return (number, Some(fault));
            }
            Err(_) => clock.back_off(wait),
        }
        wait = wait.saturating_mul(2).min(Duration::from_secs(3_600));
    }
    (policy.tries, None)
}
