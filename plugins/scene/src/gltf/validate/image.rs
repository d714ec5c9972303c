//! Images: one source each, bytes that are what they claim to be.

use intrados_stage::Cancelled;
use serde_json::Value;

use super::Check;
use crate::gltf::{document::Uri, import::material, json::Json, problem::remedy::EXPORT};

/// Where images lie.
pub(super) fn check_places(check: &mut Check) {
    for (i, image) in
        check.document.root.list("images").iter().enumerate().filter(|(_, image)| image.is_object())
    {
        let at = format!("/images/{i}");
        let view = image.get("bufferView");
        if image.get("uri").is_some() == view.is_some() {
            check.error(&*at, "IMAGE", "an image has either a uri or a bufferView", EXPORT);
        }
        if view.is_some() && image.get("mimeType").is_none() {
            check.error(&*at, "IMAGE", "an image in a buffer must declare its mimeType", EXPORT);
        }
        let view =
            image.index("bufferView").and_then(|v| check.document.root.list("bufferViews").get(v));
        if view.is_some_and(|v| v.get("byteStride").is_some()) {
            check.error(format!("{at}/bufferView"), "STRIDE", "an image has no stride", EXPORT);
        }
        if let Some(Err(problem)) = image.text("uri").map(Uri::parse) {
            check.push(problem.under(&format!("{at}/uri")));
        }
    }
}

/// What images hold.
pub(super) fn check_bytes(check: &mut Check) -> Result<(), Cancelled> {
    for (i, image) in
        check.document.root.list("images").iter().enumerate().filter(|(_, image)| image.is_object())
    {
        check.job.step(8, 10)?;
        let at = format!("/images/{i}");
        let declared = match image.text("uri").map(Uri::parse) {
            Some(Ok(Uri::Remote)) => {
                check.warn(
                    format!("{at}/uri"),
                    "URI_REMOTE",
                    "images are not fetched from a network",
                    "put the file beside the model",
                );
                continue;
            }
            Some(Ok(Uri::Data { media_type, .. })) => Some(media_type),
            Some(Ok(Uri::File(_))) => None,
            Some(Err(_)) => continue,
            // An image whose buffer view has no bytes in this file is legal.
            None if image.index("bufferView").is_none_or(|v| check.document.view(v).is_none()) => {
                continue;
            }
            None => None,
        };
        match material::image_bytes(check.document, image) {
            Ok(bytes) => content(check, image, declared, &bytes, &at),
            Err(message) => check.error(
                format!("{at}/uri"),
                "FILE_NOT_READABLE",
                message,
                "put the file beside the model",
            ),
        }
    }
    Ok(())
}

/// The media type that bytes show.
fn recognised(bytes: &[u8]) -> Option<&'static str> {
    const MAGIC: [(&[u8], &str); 4] = [
        (b"\x89PNG\r\n\x1a\n", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"GIF8", "image/gif"),
        (b"\xabKTX 20\xbb", "image/ktx2"),
    ];
    let webp = bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP");
    MAGIC
        .iter()
        .find(|(magic, _)| bytes.starts_with(magic))
        .map(|(_, name)| *name)
        .or(webp.then_some("image/webp"))
}

fn content(check: &mut Check, image: &Value, in_uri: Option<&str>, bytes: &[u8], at: &str) {
    let Some(actual) = recognised(bytes) else {
        check.warn(
            at,
            "IMAGE_FORMAT",
            "the bytes are no image that glTF knows",
            "save it as PNG or JPEG",
        );
        return;
    };
    for declared in [in_uri, image.text("mimeType")].into_iter().flatten() {
        if declared != actual && declared.starts_with("image/") {
            check.error(
                at,
                "IMAGE_FORMAT",
                format!("the image is {actual} but declared as {declared}"),
                "correct the declaration",
            );
        }
    }
    if !["image/png", "image/jpeg"].contains(&actual) {
        check.warn(at, "IMAGE_FORMAT", format!("{actual} is not read"), "save it as PNG or JPEG");
        return;
    }
    if let Err(message) = material::decode(check.document, bytes) {
        if message.contains(material::BEYOND) {
            check.warn(at, "TOO_BIG", message, "scale it down");
        } else {
            check.error(at, "IMAGE", format!("the image is damaged: {message}"), "save it again");
        }
    }
}
