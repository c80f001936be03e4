//! Sessions in S3-compatible object stores: read by ranges, moved there and back.
//!
//! [`connect`] makes SQLite read objects. [`skinrig_recorder::use_object_store`] takes the connection as [`Objects`]; then
//! [`skinrig_recorder::SessionReader`] opens references. The environment names the store and its user, as for Amazon's own tools:
//! `AWS_ENDPOINT_URL`, `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_DEFAULT_REGION`, `AWS_ALLOW_HTTP`.

mod address;
mod pages;
mod store;
mod transfer;
mod vfs;

use std::sync::{Arc, Mutex, PoisonError};

use skinrig_recorder::{OBJECTS_VFS, ObjectError, ObjectStore, ReadSeek};

use crate::pages::{PageReader, Pages};

pub use address::{AddressError, ObjectUrl};
pub use store::{Store, StoreError};
pub use transfer::ListedObject;

/// The store of this program.
static CONNECTED: Mutex<Option<Arc<Store>>> = Mutex::new(None);

/// Makes SQLite read objects of the store that `variables` of the environment describe; nothing is asked of it yet. Repeated calls
/// return the same store.
///
/// # Errors
/// [`StoreError::Start`] if the system gives no thread.
pub fn connect(
    variables: impl IntoIterator<Item = (String, String)>,
) -> Result<Arc<Store>, StoreError> {
    let mut connected = CONNECTED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(store) = &*connected {
        return Ok(store.clone());
    }
    let store = Arc::new(Store::new(variables)?);
    if !vfs::register(OBJECTS_VFS, store.clone()) {
        return Err(StoreError::Register);
    }
    *connected = Some(store.clone());
    Ok(store)
}

/// A store as the recorder sees it.
#[derive(Debug)]
pub struct Objects(pub Arc<Store>);

impl ObjectStore for Objects {
    fn size(&self, url: &str) -> Result<u64, ObjectError> {
        let url = ObjectUrl::parse(url)?;
        Ok(self.0.head(&url)?.size)
    }

    fn open(&self, url: &str) -> Result<Box<dyn ReadSeek>, ObjectError> {
        let url = ObjectUrl::parse(url)?;
        let pages = Pages::open(self.0.clone(), url)?;
        Ok(Box::new(PageReader { pages, at: 0 }))
    }

    fn failure(&self, url: &str) -> Option<ObjectError> {
        self.0.take(url).map(Into::into)
    }
}
