//! Version 2.2, text.

use glam::DVec3;

use super::{Fault, Kind, MAX_COUNT, Raw, RawElement, SUPPORTED, Source, v4::physical_names};

pub(super) fn read(mut source: Source<'_>) -> Result<Raw, Fault> {
    source.expect("$EndMeshFormat")?;
    let mut raw = Raw::default();
    let (mut nodes, mut elements) = (false, false);
    while let Some(section) = source.section()? {
        let again = |seen: bool, source: &Source<'_>| {
            if seen { Err(source.fault(format!("a second {section}"))) } else { Ok(()) }
        };
        match section {
            "$PhysicalNames" => {
                physical_names(&mut source, &mut raw)?;
                source.expect("$EndPhysicalNames")?;
            }
            "$Nodes" => {
                again(nodes, &source)?;
                for _ in 0..source.count(2, MAX_COUNT)? {
                    raw.labels.push(source.tag()?);
                    raw.points.push(DVec3::new(
                        source.double()?,
                        source.double()?,
                        source.double()?,
                    ));
                }
                source.expect("$EndNodes")?;
                nodes = true;
            }
            "$Elements" => {
                again(elements, &source)?;
                for _ in 0..source.count(2, MAX_COUNT)? {
                    let element = element(&mut source, &mut raw)?;
                    raw.elements.push(element);
                }
                source.expect("$EndElements")?;
                elements = true;
            }
            other => source.skip(other)?,
        }
    }
    if nodes && elements {
        Ok(raw)
    } else {
        Err(source.fault("no $Nodes or no $Elements: is the file cut off?"))
    }
}

/// Number, type, how many tags, the tags (the first is the physical group, 0: none), nodes.
fn element(source: &mut Source<'_>, raw: &mut Raw) -> Result<RawElement, Fault> {
    let label = source.tag()?;
    let line = source.line();
    let number = source.int()?;
    let kind = Kind(i64::from(number));
    let width = kind.nodes().ok_or_else(|| {
        source.fault(format!("element type {number} is not known; supported are {SUPPORTED}"))
    })?;
    let mut physical = Vec::new();
    for t in 0..source.count(2, 64)? {
        let tag = source.int()?;
        if t == 0 && tag != 0 {
            physical.push(tag);
        }
    }
    let first = raw.nodes.len();
    for _ in 0..width {
        raw.nodes.push(source.tag()?);
    }
    let group = raw.group(kind.dimension(), physical);
    Ok(RawElement { label, first, kind, group, line })
}
