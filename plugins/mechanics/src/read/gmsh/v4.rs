//! Version 4.1.

use std::collections::HashMap;

use glam::DVec3;

use super::{Fault, Kind, MAX_COUNT, Raw, RawElement, SUPPORTED, Source, quote};

/// Entities of a file.
const MAX_ENTITIES: usize = 10_000_000;

/// Physical groups of the entities by (dimension, tag).
type Entities = HashMap<(i32, i32), Vec<i32>>;

pub(super) fn read(mut source: Source<'_>) -> Result<Raw, Fault> {
    source.expect("$EndMeshFormat")?;
    let mut raw = Raw::default();
    let mut entities = Entities::new();
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
            "$Entities" => {
                source.begin_data();
                read_entities(&mut source, &mut entities)?;
                source.expect("$EndEntities")?;
            }
            "$Nodes" => {
                again(nodes, &source)?;
                source.begin_data();
                read_nodes(&mut source, &mut raw)?;
                source.expect("$EndNodes")?;
                nodes = true;
            }
            "$Elements" => {
                again(elements, &source)?;
                source.begin_data();
                read_elements(&mut source, &mut raw, &entities)?;
                source.expect("$EndElements")?;
                elements = true;
            }
            "$PartitionedEntities" | "$GhostElements" => {
                return Err(source
                    .fault(format!("{section}: a partitioned mesh; save it unpartitioned (Mesh.PartitionOldStyleMsh or unpartition)")));
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

/// Text in both forms: dimension, tag, "name".
pub(super) fn physical_names(source: &mut Source<'_>, raw: &mut Raw) -> Result<(), Fault> {
    let word = source.word()?;
    let count: usize =
        word.parse().map_err(|_| source.fault(format!("{} is not a count", quote(word))))?;
    if count > MAX_ENTITIES {
        return Err(source.fault(format!("{count} physical names: at most {MAX_ENTITIES}")));
    }
    for _ in 0..count {
        let dimension = match source.word()? {
            "0" => 0,
            "1" => 1,
            "2" => 2,
            "3" => 3,
            other => return Err(source.fault(format!("{} is no dimension (0 to 3)", quote(other)))),
        };
        let word = source.word()?;
        let tag = word
            .parse()
            .map_err(|_| source.fault(format!("{} is not a whole number", quote(word))))?;
        let name = source.rest_of_line()?.trim_matches('"').trim();
        if name.is_empty() || name.len() > 1024 {
            return Err(source.fault("a physical name must have 1 to 1024 bytes"));
        }
        if raw.names.insert((dimension, tag), name.to_owned()).is_some() {
            return Err(source
                .fault(format!("physical group {tag} of dimension {dimension} is named twice")));
        }
    }
    Ok(())
}

fn read_entities(source: &mut Source<'_>, entities: &mut Entities) -> Result<(), Fault> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.count(2, MAX_ENTITIES)?;
    }
    for (dimension, count) in (0i32..).zip(counts) {
        for _ in 0..count {
            let tag = source.int()?;
            // A point, or the two corners of a box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                source.double()?;
            }
            let groups = source.count(2, MAX_ENTITIES)?;
            // Tags are negative where an entity is turned round.
            let groups = (0..groups)
                .map(|_| Ok(source.int()?.saturating_abs()))
                .collect::<Result<Vec<_>, Fault>>()?;
            if dimension > 0 {
                for _ in 0..source.count(2, MAX_ENTITIES)? {
                    source.int()?;
                }
            }
            if !groups.is_empty() {
                entities.insert((dimension, tag), groups);
            }
        }
    }
    Ok(())
}

fn read_nodes(source: &mut Source<'_>, raw: &mut Raw) -> Result<(), Fault> {
    let blocks = source.count(2, MAX_COUNT)?;
    let total = source.count(2, MAX_COUNT)?;
    source.pass(2)?;
    for _ in 0..blocks {
        let (dimension, _tag, parametric) = (source.int()?, source.int()?, source.int()?);
        if !(0..=3).contains(&dimension) || !(0..=1).contains(&parametric) {
            return Err(source.fault(format!(
                "a block of nodes of dimension {dimension}, parametric {parametric}"
            )));
        }
        let count = source.count(2, total.saturating_sub(raw.labels.len()))?;
        for _ in 0..count {
            raw.labels.push(source.tag()?);
        }
        for _ in 0..count {
            raw.points.push(DVec3::new(source.double()?, source.double()?, source.double()?));
            // Coordinates on the curve or surface.
            for _ in 0..parametric * dimension {
                source.double()?;
            }
        }
    }
    if raw.labels.len() == total {
        Ok(())
    } else {
        Err(source.fault(format!("{total} nodes are announced, {} are here", raw.labels.len())))
    }
}

fn read_elements(source: &mut Source<'_>, raw: &mut Raw, entities: &Entities) -> Result<(), Fault> {
    let blocks = source.count(2, MAX_COUNT)?;
    let total = source.count(2, MAX_COUNT)?;
    source.pass(2)?;
    for _ in 0..blocks {
        let (dimension, tag, number) = (source.int()?, source.int()?, source.int()?);
        let kind = Kind(i64::from(number));
        let unknown = |source: &Source<'_>| {
            source.fault(format!("element type {number} is not known; supported are {SUPPORTED}"))
        };
        let width = kind.nodes().ok_or_else(|| unknown(source))?;
        let count = source.count(2, total.saturating_sub(raw.elements.len()))?;
        let group = raw
            .group(kind.dimension(), entities.get(&(dimension, tag)).cloned().unwrap_or_default());
        for _ in 0..count {
            let label = source.tag()?;
            let line = source.line();
            let first = raw.nodes.len();
            for _ in 0..width {
                raw.nodes.push(source.tag()?);
            }
            raw.elements.push(RawElement { label, first, kind, group, line });
        }
    }
    if raw.elements.len() == total {
        Ok(())
    } else {
        Err(source
            .fault(format!("{total} elements are announced, {} are here", raw.elements.len())))
    }
}
