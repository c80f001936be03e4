//! Moves sessions into a store and back; every byte is read back before anything is replaced.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use object_store::path::Path as Key;
use object_store::{MultipartUpload, ObjectStore as _, ObjectStoreExt as _};
use sha2::{Digest, Sha256};

use crate::address::ObjectUrl;
use crate::store::{Store, StoreError};

/// Bytes of one part. Stores take parts from 5 MiB on, and up to 10,000 of them: 160 GB.
const PART: usize = 16 << 20;

/// An object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedObject {
    /// Its address.
    pub url: ObjectUrl,
    /// Its size.
    pub bytes: u64,
}

impl Store {
    /// The objects whose keys begin with that of `under` and a slash, by key.
    ///
    /// # Errors
    /// [`StoreError::Store`] if the store does not answer.
    pub fn list(&self, under: &ObjectUrl) -> Result<Vec<ListedObject>, StoreError> {
        let (bucket, key) = (self.bucket(under)?, Key::from(under.key.as_str()));
        let found = self.wait(under, async move {
            let mut found = Vec::new();
            let mut listed = bucket.list(Some(&key));
            while let Some(next) =
                std::future::poll_fn(|context| listed.as_mut().poll_next(context)).await
            {
                found.push(next?);
            }
            Ok(found)
        })?;
        let mut found: Vec<ListedObject> = found
            .into_iter()
            .map(|meta| ListedObject {
                url: ObjectUrl {
                    bucket: under.bucket.clone(),
                    key: meta.location.to_string(),
                },
                bytes: meta.size,
            })
            .collect();
        found.sort_by(|a, b| a.url.cmp(&b.url));
        Ok(found)
    }

    /// Sends a file, and reads it back. An object with the same bytes is not sent again. `progress` gets the bytes of each part.
    ///
    /// # Errors
    /// [`StoreError::Exists`] for another object of this name; [`StoreError::Differs`] if it is not what was sent; errors of the store
    /// and of the file.
    pub fn send(
        &self,
        file: &Path,
        url: &ObjectUrl,
        progress: &mut dyn FnMut(u64),
    ) -> Result<(), StoreError> {
        let (bytes, digest) = digest_of_file(file)?;
        match self.head(url) {
            Ok(found) => {
                return match found.size == bytes && self.digest(url, bytes, progress)? == digest {
                    true => Ok(()),
                    false => Err(StoreError::Exists { url: url.clone() }),
                };
            }
            Err(StoreError::Missing { .. }) => {}
            Err(other) => return Err(other),
        }
        self.upload(file, url, progress).map_err(|e| match e {
            StoreError::Missing { url } => StoreError::NoBucket { url },
            other => other,
        })?;
        match self.digest(url, bytes, progress)? == digest {
            true => Ok(()),
            false => Err(StoreError::Differs {
                url: url.clone(),
                expected: bytes,
            }),
        }
    }

    fn upload(
        &self,
        path: &Path,
        url: &ObjectUrl,
        progress: &mut dyn FnMut(u64),
    ) -> Result<(), StoreError> {
        let io = file_error(path);
        let mut file = File::open(path).map_err(&io)?;
        let (bucket, key) = (self.bucket(url)?, Key::from(url.key.as_str()));
        let mut upload: Box<dyn MultipartUpload> =
            self.wait(url, async move { bucket.put_multipart(&key).await })?;
        let mut send = || loop {
            let mut part = Vec::with_capacity(PART);
            let read = Read::take(&mut file, PART as u64).read_to_end(&mut part);
            let count = read.map_err(&io)? as u64;
            if count == 0 {
                return Ok(());
            }
            let sent = upload.put_part(part.into());
            self.wait(url, sent)?;
            progress(count);
        };
        let sent = send();
        self.wait(url, async move {
            match sent.is_ok() {
                true => upload.complete().await.map(drop),
                // The store deletes the parts; the first error counts.
                false => upload.abort().await.or(Ok(())),
            }
            .map(|()| sent)
        })?
    }

    /// SHA-256 of the first `bytes` of an object, by ranges.
    fn digest(
        &self,
        url: &ObjectUrl,
        bytes: u64,
        progress: &mut dyn FnMut(u64),
    ) -> Result<[u8; 32], StoreError> {
        let mut hasher = Sha256::new();
        self.each_range(url, bytes, &mut |part| {
            hasher.update(part);
            progress(part.len() as u64);
            Ok(())
        })?;
        Ok(hasher.finalize().into())
    }

    fn each_range(
        &self,
        url: &ObjectUrl,
        bytes: u64,
        each: &mut dyn FnMut(&[u8]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let tag = self.head(url)?.e_tag;
        let mut at = 0;
        while at < bytes {
            let to = bytes.min(at + PART as u64);
            let part = self.range(url, tag.as_deref(), at..to)?;
            if part.is_empty() {
                break;
            }
            at += part.len() as u64;
            each(&part)?;
        }
        Ok(())
    }
}

fn file_error(path: &Path) -> impl Fn(std::io::Error) -> StoreError {
    let path = path.to_owned();
    move |source| StoreError::File {
        path: path.clone(),
        source,
    }
}

fn digest_of_file(path: &Path) -> Result<(u64, [u8; 32]), StoreError> {
    let io = file_error(path);
    let mut file = File::open(path).map_err(&io)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 20];
    let mut bytes = 0;
    loop {
        let read = file.read(&mut buffer).map_err(&io)?;
        if read == 0 {
            return Ok((bytes, hasher.finalize().into()));
        }
        hasher.update(&buffer[..read]);
        bytes += read as u64;
    }
}
