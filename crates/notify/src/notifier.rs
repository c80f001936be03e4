//! Queues, threads and the grace: what a run uses to send messages without waiting for them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use skinrig_model::{Notification, NotificationChannel, NotificationFault, Occasion};

use crate::attempt::{Channel, deliver};
use crate::clock::{Clock, Pending};
use crate::message::Message;
use crate::policy::Policy;

/// Most messages that wait for one channel.
const QUEUE: u32 = 8;

/// A message on one channel, and its result.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// The channel.
    pub channel: NotificationChannel,
    /// Number of tries that ended.
    pub tries: u32,
    /// Civil time of the result, RFC 3339.
    pub ended_at: String,
    /// Why it was not sent; `None`: the receiver accepted it.
    pub fault: Option<NotificationFault>,
    message: Arc<Message>,
}

impl Delivery {
    /// Its record; `None` for a test.
    #[must_use]
    pub fn notification(&self) -> Option<Notification> {
        Some(Notification {
            channel: self.channel,
            occasion: self.message.occasion?,
            subject: self.message.subject.clone(),
            raised_at: self.message.raised_at.clone(),
            ended_at: self.ended_at.clone(),
            tries: self.tries,
            fault: self.fault.clone(),
        })
    }
}

/// A message on one channel so far.
#[derive(Default)]
struct Progress {
    /// Number of tries that ended, and the fault of the last one.
    tries: u32,
    last: Option<NotificationFault>,
    result: Option<Delivery>,
}

/// State shared with the threads.
struct Shared {
    clock: Arc<dyn Clock>,
    policy: Policy,
    pending: Pending,
    /// In the order of posting.
    results: Mutex<Vec<Progress>>,
    is_over: AtomicBool,
}

impl Shared {
    fn end(&self, number: usize, delivery: Delivery) {
        self.update(number, |progress| progress.result = Some(delivery));
        self.pending.remove();
    }

    fn update(&self, number: usize, change: impl FnOnce(&mut Progress)) {
        let mut results = self.results.lock().unwrap_or_else(PoisonError::into_inner);
        // After the end, the results are gone.
        if let Some(progress) = results.get_mut(number) {
            change(progress);
        }
    }
}

/// A posted message: its number, and the message.
type Posted = (usize, Arc<Message>);

/// Sends messages on threads of their own, one per channel.
pub struct Notifier {
    on: Vec<Occasion>,
    queues: Vec<(NotificationChannel, SyncSender<Posted>)>,
    /// What was posted, by number.
    posted: Vec<(NotificationChannel, Arc<Message>)>,
    shared: Arc<Shared>,
}

impl Notifier {
    /// Starts a thread for each of `channels`, which get messages on the occasions `on`.
    ///
    /// # Errors
    /// I/O errors of starting a thread.
    pub fn start(
        on: &[Occasion],
        channels: Vec<Box<dyn Channel>>,
        policy: Policy,
        clock: Arc<dyn Clock>,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            clock,
            policy,
            pending: Pending::default(),
            results: Mutex::default(),
            is_over: AtomicBool::new(false),
        });
        let mut queues = Vec::new();
        for channel in channels {
            let name = channel.name();
            let (queue, posted) = sync_channel(QUEUE as usize);
            let shared = Arc::clone(&shared);
            std::thread::Builder::new()
                .name(format!("notify-{name}"))
                .spawn(move || work(channel, &posted, &shared))?;
            queues.push((name, queue));
        }
        Ok(Self {
            on: on.to_vec(),
            queues,
            posted: Vec::new(),
            shared,
        })
    }

    /// Posts `message` to all channels, unless its occasion was not chosen. Never waits: a channel whose queue is full does not get it.
    pub fn post(&mut self, message: Message) {
        if message
            .occasion
            .is_some_and(|occasion| !self.on.contains(&occasion))
        {
            return;
        }
        let message = Arc::new(message);
        for (channel, queue) in &self.queues {
            let number = self.posted.len();
            self.posted.push((*channel, Arc::clone(&message)));
            self.shared
                .results
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(Progress::default());
            self.shared.pending.add();
            match queue.try_send((number, Arc::clone(&message))) {
                Ok(()) => {}
                Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
                    let delivery = Delivery {
                        channel: *channel,
                        tries: 0,
                        ended_at: self.shared.clock.civil_time(),
                        fault: Some(NotificationFault::QueueFull { limit: QUEUE }),
                        message: Arc::clone(&message),
                    };
                    self.shared.end(number, delivery);
                }
            }
        }
    }

    /// Waits for results, at most for the grace, and returns one per message and channel, in the order of posting.
    #[must_use]
    pub fn finish(self) -> Vec<Delivery> {
        let Self { posted, shared, .. } = self;
        shared.clock.wait(&shared.pending, shared.policy.grace);
        shared.is_over.store(true, Ordering::Relaxed);
        let results = shared.results.lock();
        let results = std::mem::take(&mut *results.unwrap_or_else(PoisonError::into_inner));
        let ended_at = shared.clock.civil_time();
        let all = posted.into_iter().zip(results);
        all.map(|((channel, message), progress)| {
            let Progress {
                tries,
                last,
                result,
            } = progress;
            result.unwrap_or_else(|| Delivery {
                channel,
                tries,
                ended_at: ended_at.clone(),
                fault: Some(NotificationFault::GraceOver {
                    grace_s: shared.policy.grace.as_secs(),
                    last: last.map(Box::new),
                }),
                message,
            })
        })
        .collect()
    }
}

/// The thread of one channel.
fn work(mut channel: Box<dyn Channel>, posted: &Receiver<Posted>, shared: &Shared) {
    let is_over = || shared.is_over.load(Ordering::Relaxed);
    while let Ok((number, message)) = posted.recv() {
        if is_over() {
            return;
        }
        let (tries, fault) = deliver(
            channel.as_mut(),
            &message,
            shared.policy,
            shared.clock.as_ref(),
            &is_over,
            &|tries, fault| {
                shared.update(number, |progress| {
                    progress.tries = tries;
                    progress.last = Some(fault.clone());
                });
            },
        );
        let delivery = Delivery {
            channel: channel.name(),
            tries,
            ended_at: shared.clock.civil_time(),
            fault,
            message,
        };
        shared.end(number, delivery);
    }
}
