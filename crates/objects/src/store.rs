//! Access to a store: its buckets, ranges of objects, and the errors that SQLite cannot carry.

use std::collections::HashMap;
use std::future::Future;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;

use object_store::aws::{AmazonS3, AmazonS3Builder, AmazonS3ConfigKey};
use object_store::path::Path;
use object_store::{
    GetOptions, GetRange, ObjectMeta, ObjectStore as _, ObjectStoreExt as _, RetryConfig,
};
use tokio::runtime::Runtime;

use crate::address::{AddressError, ObjectUrl};

/// How long a request is tried again while the store does not answer or is overloaded.
const RETRY: Duration = Duration::from_secs(20);

/// An operation on a store failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// Text that is no address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The store refused, failed or did not answer.
    #[error(
        "{url}: {source}; AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_DEFAULT_REGION name the store and its user"
    )]
    Store {
        /// Address of the object.
        url: ObjectUrl,
        /// Error of the store.
        source: Box<object_store::Error>,
    },
    /// The object was replaced while it was read.
    #[error("{url}: the object was replaced while it was read; read it again")]
    Replaced {
        /// Address of the object.
        url: ObjectUrl,
    },
    /// The store has another object of this name.
    #[error(
        "{url}: expected no object, or one with the bytes of the session, found another; choose another address"
    )]
    Exists {
        /// Address of the object.
        url: ObjectUrl,
    },
    /// The object does not have the bytes that were sent.
    #[error(
        "{url}: expected the {expected} bytes that were sent, found others; the file stays: send it again"
    )]
    Differs {
        /// Address of the object.
        url: ObjectUrl,
        /// Size of the file.
        expected: u64,
    },
    /// A file could not be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: std::path::PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// There is no such object.
    #[error("{url}: expected an object, found none")]
    Missing {
        /// Address of the object.
        url: ObjectUrl,
    },
    /// There is no such bucket.
    #[error("{url}: expected a bucket `{}`, found none; create it first", url.bucket)]
    NoBucket {
        /// Address of the object.
        url: ObjectUrl,
    },
    /// The threads that read objects could not start.
    #[error("cannot start to read objects: {0}")]
    Start(std::io::Error),
    /// SQLite takes no file system.
    #[error("cannot start to read objects: SQLite refused it")]
    Register,
}

/// The store that the environment describes, with the variables of Amazon's tools.
#[derive(Debug)]
pub struct Store {
    settings: AmazonS3Builder,
    runtime: Runtime,
    buckets: Mutex<HashMap<String, Arc<AmazonS3>>>,
    failures: Mutex<HashMap<String, StoreError>>,
    bytes_read: AtomicU64,
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Store {
    /// The store that these variables of the environment describe; nothing is asked of it yet.
    ///
    /// # Errors
    /// [`StoreError::Start`] if the system gives no thread.
    pub fn new(variables: impl IntoIterator<Item = (String, String)>) -> Result<Self, StoreError> {
        // The first provider of a process stays.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("objects")
            .enable_all()
            .build()
            .map_err(StoreError::Start)?;
        let mut settings = AmazonS3Builder::new();
        for (name, value) in variables
            .into_iter()
            .filter(|(name, _)| name.starts_with("AWS_"))
        {
            if let Ok(key) = name.to_ascii_lowercase().parse::<AmazonS3ConfigKey>() {
                // Whoever names a server without encryption, as on a bench network, wants it.
                if name.starts_with("AWS_ENDPOINT") && value.starts_with("http://") {
                    settings = settings.with_allow_http(true);
                }
                settings = settings.with_config(key, value);
            }
        }
        Ok(Self {
            settings,
            runtime,
            buckets: Mutex::default(),
            failures: Mutex::default(),
            bytes_read: AtomicU64::new(0),
        })
    }

    /// Bytes of objects that were read.
    #[must_use]
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    /// The bucket of an address.
    pub(crate) fn bucket(&self, url: &ObjectUrl) -> Result<Arc<AmazonS3>, StoreError> {
        let mut buckets = lock(&self.buckets);
        if let Some(known) = buckets.get(&url.bucket) {
            return Ok(known.clone());
        }
        let retry = RetryConfig {
            max_retries: 4,
            retry_timeout: RETRY,
            ..RetryConfig::default()
        };
        let settings = self.settings.clone();
        let built = settings.with_bucket_name(&url.bucket).with_retry(retry);
        let built = built.build();
        let built = Arc::new(built.map_err(|e| Self::failed(url, e))?);
        buckets.insert(url.bucket.clone(), built.clone());
        Ok(built)
    }

    /// Runs `work` on the threads of the store, and waits for it. Callers may be inside another runtime.
    pub(crate) fn wait<T: Send + 'static>(
        &self,
        url: &ObjectUrl,
        work: impl Future<Output = object_store::Result<T>> + Send + 'static,
    ) -> Result<T, StoreError> {
        let (done, result) = mpsc::sync_channel(1);
        self.runtime.spawn(async move {
            // Whoever waits is there until it has the result.
            let _ = done.send(work.await);
        });
        let ended = |_| object_store::Error::Generic {
            store: "S3",
            source: "the request was ended".into(),
        };
        let result = result.recv().map_err(ended).and_then(|result| result);
        result.map_err(|e| Self::failed(url, e))
    }

    pub(crate) fn failed(url: &ObjectUrl, error: object_store::Error) -> StoreError {
        let url = url.clone();
        match error {
            object_store::Error::Precondition { .. } => StoreError::Replaced { url },
            object_store::Error::NotFound { .. } => StoreError::Missing { url },
            other => StoreError::Store {
                url,
                source: Box::new(other),
            },
        }
    }

    /// What the store says of an object.
    pub(crate) fn head(&self, url: &ObjectUrl) -> Result<ObjectMeta, StoreError> {
        let (bucket, key) = (self.bucket(url)?, Path::from(url.key.as_str()));
        self.wait(url, async move { bucket.head(&key).await })
    }

    /// Bytes of an object, which must still be the one with this tag.
    pub(crate) fn range(
        &self,
        url: &ObjectUrl,
        tag: Option<&str>,
        range: Range<u64>,
    ) -> Result<Vec<u8>, StoreError> {
        let (bucket, key) = (self.bucket(url)?, Path::from(url.key.as_str()));
        let options = GetOptions {
            range: Some(GetRange::Bounded(range)),
            if_match: tag.map(str::to_owned),
            ..GetOptions::default()
        };
        let bytes = self.wait(url, async move {
            bucket.get_opts(&key, options).await?.bytes().await
        })?;
        self.bytes_read
            .fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(bytes.into())
    }

    /// Keeps the error that makes an access of SQLite fail.
    pub(crate) fn keep(&self, url: &ObjectUrl, error: StoreError) {
        lock(&self.failures).insert(url.to_string(), error);
    }

    /// Takes the kept error.
    pub(crate) fn take(&self, url: &str) -> Option<StoreError> {
        lock(&self.failures).remove(url)
    }
}
