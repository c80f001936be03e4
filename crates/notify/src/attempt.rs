//! One channel, and the tries to send a message on it.

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

/// Tries until the message is accepted, the fault is final, the tries are used up or `is_over`. Calls `ended` after each try with its
/// number and fault. Returns the number of tries, and the fault of the last one.
pub(crate) fn deliver(
    channel: &mut dyn Channel,
    message: &Message,
    policy: Policy,
    clock: &dyn Clock,
    is_over: &dyn Fn() -> bool,
    ended: &dyn Fn(u32, &NotificationFault),
) -> (u32, Option<NotificationFault>) {
    let mut wait = policy.backoff;
    let mut tries = 1;
    loop {
        let Err(fault) = channel.send(message) else {
            return (tries, None);
        };
        ended(tries, &fault);
        if tries >= policy.tries || !fault.is_transient() {
            return (tries, Some(fault));
        }
        clock.back_off(wait);
        if is_over() {
            return (tries, Some(fault));
        }
        wait = wait.saturating_mul(2);
        tries += 1;
    }
}
