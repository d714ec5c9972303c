//! A file in memory: its JSON and its buffers, read within limits.

use std::{
    borrow::Cow,
    cell::Cell,
    ops::Range,
    path::{Component, Path, PathBuf},
};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use intrados_stage::{Access, Job, access};
use serde_json::Value;

use super::{
    MAX_TEXELS, glb,
    json::Json,
    meshopt,
    problem::{
        GltfProblem, ImportError, Place, Severity,
        remedy::{EXPORT, SMALLER},
    },
};

/// Bytes that a model may have in all its files together.
const MAX_BYTES: u64 = 2 << 30;
/// Bytes of memory that the parsed JSON may take, estimated before parsing.
const MAX_JSON: usize = 512 << 20;
/// Bytes of zeros, repetitions and decompressed data that any file may ask for, however small it
/// is.
const FREE_BYTES: usize = 128 << 20;
/// Bytes decoded for each byte read: an honest file needs 16 at most (one-byte strip indices become
/// three four-byte ones).
const EXPANSION: usize = 16;

/// Numbers that may be read from accessors, all readings counted: some for every byte of the files,
/// for many parts may share one buffer, and some for zeros that no byte stands for. A small file
/// could have the same bytes read over and over, or ask for a thousand million zeros.
const MAX_READS: usize = 1_000_000_000;
const READS_PER_BYTE: usize = 100;
const FREE_READS: usize = 16 << 20;

/// A glTF file with its buffers.
#[derive(Debug)]
pub(super) struct Document {
    /// The file.
    pub path: PathBuf,
    /// Where links from its folder may lead.
    pub access: Access,
    /// The JSON.
    pub root: Value,
    /// How many bytes decoding may still take: bounds what a small file can ask for.
    budget: Cell<usize>,
    /// How many numbers may still be read: bounds the time.
    reads: Cell<usize>,
    /// How many texels may still be decoded.
    pub texels: Cell<usize>,
    file: Vec<u8>,
    buffers: Vec<Buffer>,
    /// Decompressed buffer views.
    views: Vec<Option<Vec<u8>>>,
}

#[derive(Debug)]
enum Buffer {
    /// The bytes are not ours to have: no `uri` outside a GLB (legal), a URL, or a problem that was
    /// reported.
    Absent,
    Chunk(Range<usize>),
    Loaded(Vec<u8>),
}

impl Document {
    /// Reads a file and all its buffers. Problems of container, JSON and buffers are appended to
    /// `problems`. `None`: there is no JSON to go on with.
    pub(super) fn open(
        path: &Path,
        access: &Access,
        job: &Job,
        problems: &mut Vec<GltfProblem>,
    ) -> Result<Option<Self>, ImportError> {
        let file = access::read(path, MAX_BYTES)
            .map_err(|source| ImportError::Read { path: path.into(), source })?;
        job.step(1, 10)?;
        let (text, bin) = if glb::is_glb(&file, path) {
            let chunks = glb::read(&file, problems);
            (chunks.json, chunks.bin)
        } else {
            (Some(0..file.len()), None)
        };
        let Some(root) = text.and_then(|range| parse(file.get(range).unwrap_or(&[]), problems))
        else {
            return Ok(None);
        };
        job.step(3, 10)?;
        let mut document = Self {
            path: path.into(),
            access: access.clone(),
            root,
            budget: Cell::new(0),
            reads: Cell::new(0),
            texels: Cell::new(MAX_TEXELS),
            file,
            buffers: Vec::new(),
            views: Vec::new(),
        };
        document.load_buffers(bin, problems);
        job.step(4, 10)?;
        document.decompress(job, problems)?;
        Ok(Some(document))
    }

    /// Takes `bytes` from what decoding may still use.
    pub(super) fn spend(&self, bytes: usize) -> Result<(), GltfProblem> {
        let left = self.budget.get().checked_sub(bytes).ok_or_else(|| {
            GltfProblem::error(
                "",
                "TOO_BIG",
                "the model would decode to far more than its files hold, beyond the memory limit",
                SMALLER,
            )
        })?;
        self.budget.set(left);
        Ok(())
    }

    /// Takes `numbers` from what may still be read.
    pub(super) fn work(&self, numbers: usize) -> Result<(), GltfProblem> {
        let left = self.reads.get().checked_sub(numbers);
        let left = left.ok_or_else(|| {
            GltfProblem::error(
                "",
                "TOO_MUCH_READING",
                "the accessors hold far more numbers than the files have bytes for",
                SMALLER,
            )
        })?;
        self.reads.set(left);
        Ok(())
    }

    /// The bytes of a buffer view; `None` where they do not exist. Empty where its range is out of
    /// the buffer.
    pub(super) fn view(&self, index: usize) -> Option<&[u8]> {
        if let Some(Some(view)) = self.views.get(index) {
            return Some(view);
        }
        let view = self.root.list("bufferViews").get(index)?;
        self.slice(view)
    }

    /// The bytes that an object with `buffer`, `byteOffset` and `byteLength` names.
    fn slice(&self, view: &Value) -> Option<&[u8]> {
        let bytes = self.buffer(view.index("buffer")?)?;
        let start = view.index("byteOffset").unwrap_or(0);
        let stop = start.checked_add(view.index("byteLength")?)?;
        Some(bytes.get(start..stop).unwrap_or(&[]))
    }

    fn buffer(&self, index: usize) -> Option<&[u8]> {
        match self.buffers.get(index)? {
            Buffer::Absent => None,
            Buffer::Chunk(range) => self.file.get(range.clone()),
            Buffer::Loaded(bytes) => Some(bytes),
        }
    }

    fn load_buffers(&mut self, bin: Option<Range<usize>>, problems: &mut Vec<GltfProblem>) {
        let mut left = MAX_BYTES.saturating_sub(self.file.len() as u64);
        let mut buffers = Vec::new();
        for (i, buffer) in self.root.list("buffers").iter().enumerate() {
            let length = buffer.index("byteLength").unwrap_or(0) as u64;
            let loaded = match (buffer.text("uri"), &bin) {
                (Some(uri), _) => self.load(
                    uri,
                    length,
                    left,
                    &["application/octet-stream", "application/gltf-buffer"],
                ),
                (None, Some(bin)) if i == 0 => Ok(Buffer::Chunk(bin.clone())),
                (None, None)
                    if i == 0 && glb::is_glb(&self.file, &self.path) && buffer.is_object() =>
                {
                    Err(GltfProblem::error(
                        "",
                        "BUFFER_NO_CHUNK",
                        "the buffer lies in the GLB's binary chunk, which is missing",
                        EXPORT,
                    ))
                }
                (None, _) => Ok(Buffer::Absent),
            };
            let loaded = loaded.unwrap_or_else(|problem| {
                problems.push(problem.under(&format!("/buffers/{i}")));
                Buffer::Absent
            });
            let size = match &loaded {
                Buffer::Absent => None,
                Buffer::Chunk(range) => Some(range.len() as u64),
                Buffer::Loaded(bytes) => Some(bytes.len() as u64),
            };
            left = left.saturating_sub(size.unwrap_or(0));
            if let Some(size) = size.filter(|&size| size < length) {
                let message = format!("the buffer has {size} bytes, {length} are declared");
                problems.push(GltfProblem::error(
                    format!("/buffers/{i}"),
                    "BUFFER_TOO_SHORT",
                    message,
                    "restore the complete file",
                ));
            }
            buffers.push(loaded);
        }
        self.buffers = buffers;
        let read = MAX_BYTES.saturating_sub(left) as usize;
        self.budget.set(read.saturating_mul(EXPANSION).saturating_add(FREE_BYTES));
        self.reads
            .set(read.saturating_mul(READS_PER_BYTE).saturating_add(FREE_READS).min(MAX_READS));
    }

    /// What a URI names, at most `length` bytes of it.
    fn load(
        &self,
        uri: &str,
        length: u64,
        left: u64,
        media: &[&str],
    ) -> Result<Buffer, GltfProblem> {
        match Uri::parse(uri).map_err(|p| p.under("/uri"))? {
            Uri::Data { media_type, bytes } => {
                if !media.iter().any(|m| m.eq_ignore_ascii_case(media_type)) {
                    let message = format!(
                        "the data has media type {media_type:?}, expected application/octet-stream"
                    );
                    return Err(GltfProblem::error("/uri", "URI_MEDIA_TYPE", message, EXPORT));
                }
                Ok(Buffer::Loaded(bytes))
            }
            Uri::Remote => Ok(Buffer::Absent),
            Uri::File(name) => Ok(Buffer::Loaded(self.beside(&name, left, length)?)),
        }
    }

    /// Bytes of a file beside the model.
    pub(super) fn beside(
        &self,
        name: &Path,
        limit: u64,
        length: u64,
    ) -> Result<Vec<u8>, GltfProblem> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        self.access.read_start(folder, &folder.join(name), limit, length).map_err(|why| {
            let message = format!("cannot read {}: it {why}", name.display());
            GltfProblem::error(
                "/uri",
                "FILE_NOT_READABLE",
                message,
                "put the file beside the model",
            )
        })
    }

    /// Decompresses the views that `EXT_meshopt_compression` packs.
    fn decompress(
        &mut self,
        job: &Job,
        problems: &mut Vec<GltfProblem>,
    ) -> Result<(), ImportError> {
        for i in 0..self.root.list("bufferViews").len() {
            let Some(packed) =
                self.root.list("bufferViews").get(i).and_then(|view| view.extension(meshopt::NAME))
            else {
                continue;
            };
            job.step(4, 10)?;
            let packed = packed.clone();
            let result = meshopt::size(&packed).and_then(|size| {
                self.spend(size)?;
                match self.slice(&packed) {
                    Some(bytes) => meshopt::decode(&packed, bytes).map(Some),
                    None => Ok(None),
                }
            });
            match result {
                Ok(view) => {
                    self.views.resize(i, None);
                    self.views.push(view);
                }
                Err(problem) => problems
                    .push(problem.under(&format!("/bufferViews/{i}/extensions/{}", meshopt::NAME))),
            }
        }
        Ok(())
    }
}

/// Parses JSON whose memory is bounded beforehand: a `Value` is 32 bytes, vectors double as they
/// grow, and a map's first leaf holds eleven entries, so that two bytes of text can become several
/// hundred.
fn parse(text: &[u8], problems: &mut Vec<GltfProblem>) -> Option<Value> {
    let memory: usize = text
        .iter()
        .map(|byte| match byte {
            b'{' => 700,
            b'[' => 160,
            b',' => 96,
            b':' => 32,
            _ => 1,
        })
        .sum();
    if memory > MAX_JSON {
        problems.push(GltfProblem::error("", "TOO_BIG", "the JSON is too big to be read", SMALLER));
        return None;
    }
    // A number beyond all range costs only itself, not the document.
    let parsed = serde_json::from_slice(text).or_else(|error| match without_infinities(text) {
        Some(text) => serde_json::from_slice(&text),
        None => Err(error),
    });
    parsed
        .map_err(|error| {
            let place = Place::Text { line: error.line(), column: error.column() };
            // serde's text ends with the place, which is said already.
            let message = error.to_string();
            let message = message.split(" at line ").next().unwrap_or("damaged").to_owned();
            let message = format!("the JSON is damaged: {message}");
            problems.push(GltfProblem {
                severity: Severity::Error,
                place,
                code: "JSON",
                message,
                remedy: EXPORT,
            });
        })
        .ok()
}

/// The text with `null` for every number that no double holds, such as `1e999`; `None` where there
/// is none. The schema reports them as no finite numbers, at their place.
fn without_infinities(text: &[u8]) -> Option<Vec<u8>> {
    let numeric = |b: &u8| b.is_ascii_digit() || matches!(b, b'-' | b'+' | b'.' | b'e' | b'E');
    let (mut out, mut rest, mut found) = (Vec::with_capacity(text.len()), text, false);
    while let Some((&first, after)) = rest.split_first() {
        let length = match first {
            b'"' => 2 + string_length(after),
            b'-' | b'0'..=b'9' => rest.iter().take_while(|b| numeric(b)).count(),
            _ => 1,
        };
        let (token, after) = rest.split_at(length.min(rest.len()));
        let infinite = first != b'"'
            && str::from_utf8(token).is_ok_and(|t| t.parse::<f64>().is_ok_and(f64::is_infinite));
        out.extend_from_slice(if infinite { b"null" } else { token });
        found |= infinite;
        rest = after;
    }
    found.then_some(out)
}

/// Bytes up to the quote that ends a string.
fn string_length(text: &[u8]) -> usize {
    let mut escaped = false;
    text.iter()
        .take_while(|&&b| {
            let inside = escaped || b != b'"';
            escaped = b == b'\\' && !escaped;
            inside
        })
        .count()
}

/// A URI of a buffer or an image.
pub(super) enum Uri<'a> {
    /// Embedded bytes.
    Data {
        /// Their media type.
        media_type: &'a str,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// A file beside the model.
    File(PathBuf),
    /// Somewhere on a network: legal, never fetched.
    Remote,
}

/// base64 with or without padding, as files have both.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

impl<'a> Uri<'a> {
    /// Takes a URI apart. Paths must stay beside the model: a file that came by mail must not read
    /// others.
    pub(super) fn parse(uri: &'a str) -> Result<Self, GltfProblem> {
        let invalid = |what: &str| {
            GltfProblem::error(
                "",
                "URI",
                format!("the URI is invalid: {what}"),
                "embed the data or name a file beside the model",
            )
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let (head, data) =
                data.split_once(',').ok_or_else(|| invalid("no comma after the media type"))?;
            let (media_type, bytes) = match head.strip_suffix(";base64") {
                Some(media_type) => (
                    media_type,
                    BASE64.decode(data.as_bytes()).map_err(|error| invalid(&error.to_string()))?,
                ),
                None => {
                    (head, percent_decoded(data).ok_or_else(|| invalid(NO_DIGITS))?.into_owned())
                }
            };
            // Parameters may follow the type, `;charset=utf-8`; an empty one is a slip of the pen.
            let (media_type, parameters) =
                media_type.split_once(';').unwrap_or((media_type, "charset"));
            if parameters.is_empty() {
                return Err(invalid("an empty parameter behind the media type"));
            }
            return Ok(Self::Data { media_type, bytes });
        }
        if let Some((scheme, _)) = uri.split_once(':') {
            let named = scheme.starts_with(|c: char| c.is_ascii_alphabetic());
            return match scheme {
                "http" | "https" => Ok(Self::Remote),
                "file" => Err(invalid("a path must be relative to the model")),
                _ if named && scheme.len() > 1 && !scheme.contains(['/', '%']) => Ok(Self::Remote),
                _ => Err(invalid("a colon where no scheme is")),
            };
        }
        let name = percent_decoded(uri).ok_or_else(|| invalid(NO_DIGITS))?;
        let name = str::from_utf8(&name).map_err(|_| invalid("its name is no UTF-8"))?;
        let path = PathBuf::from(name);
        let beside = !name.is_empty()
            && path
                .components()
                .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        // A backslash is a separator elsewhere; a NUL ends names.
        if beside && !name.contains(['\\', '\0']) {
            Ok(Self::File(path))
        } else {
            Err(invalid("it leads out of the model's folder"))
        }
    }
}

const NO_DIGITS: &str = "a percent sign without two hexadecimal digits";

fn percent_decoded(text: &str) -> Option<Cow<'_, [u8]>> {
    if !text.contains('%') {
        return Some(text.as_bytes().into());
    }
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digit = |b: Option<u8>| char::from(b?).to_digit(16);
                let (high, low) = (digit(rest.next())?, digit(rest.next())?);
                u8::try_from(16 * high + low).ok()?
            }
            _ => byte,
        });
    }
    Some(bytes.into())
}
