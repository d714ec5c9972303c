use std::path::Path;

use intrados_stage::random::Key;

use super::*;
use crate::read::solids::{HEX, TET, WEDGE};

/// Two cubes along x, a bar through the first, named groups; 4.1.
const TWO: &str = r#"$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
4
0 7 "corner"
1 5 "bar"
2 3 "left"
3 1 "concrete core"
$EndPhysicalNames
$Entities
1 1 2 1
1 0 0 0 1 7
1 0 0 0 1 0 1 1 5 2 1 -2
1 0 0 0 0 1 1 1 3 0
2 0 0 0 0 1 1 0 0
1 0 0 0 2 1 1 1 1 0
$EndEntities
$Nodes
1 12 1 12
3 1 0 12
1
2
3
4
5
6
7
8
9
10
11
12
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
2 0 0
2 1 0
2 0 1
2 1 1
$EndNodes
$Elements
5 6 1 6
0 1 15 1
1 1
1 1 1 1
2 1 7
2 1 3 1
3 1 4 8 5
2 2 3 1
4 2 3 7 6
3 1 5 2
5 1 2 3 4 5 6 7 8
6 2 9 10 3 6 11 12 7
$EndElements
"#;

fn read(bytes: &[u8], units: Units) -> Result<Mesh, String> {
    parse(bytes, units).map_err(|fault| fault.of(Path::new("a.msh")).to_string())
}

fn parse_text(text: &str) -> Result<Mesh, String> {
    read(text.as_bytes(), Units::MillimetreNewton)
}

/// The same file in Gmsh's binary form.
fn binary() -> Vec<u8> {
    let mut out = b"$MeshFormat\n4.1 1 8\n".to_vec();
    out.extend(1i32.to_le_bytes());
    out.extend(b"\n$EndMeshFormat\n");
    let section = |name: &str| {
        TWO.split_once(&format!("${name}\n"))
            .unwrap()
            .1
            .split_once(&format!("$End{name}"))
            .unwrap()
            .0
    };
    out.extend(format!("$PhysicalNames\n{}$EndPhysicalNames\n", section("PhysicalNames")).bytes());
    // Per line of text: s(ize_t, 8 bytes), i(nt), d(ouble).
    let mut put = |name: &str, kinds: &dyn Fn(usize, usize) -> char| {
        out.extend(format!("${name}\n").bytes());
        for (l, line) in section(name).lines().enumerate() {
            for (w, word) in line.split_whitespace().enumerate() {
                match kinds(l, w) {
                    's' => out.extend(word.parse::<u64>().unwrap().to_le_bytes()),
                    'i' => out.extend(word.parse::<i32>().unwrap().to_le_bytes()),
                    _ => out.extend(word.parse::<f64>().unwrap().to_le_bytes()),
                }
            }
        }
        out.extend(format!("\n$End{name}\n").bytes());
    };
    put("Entities", &|l, w| match (l, w) {
        (0, _) => 's',
        (_, 0) => 'i',
        (1, 1..=3) | (2.., 1..=6) => 'd',
        (1, 4) | (2.., 7) => 's',
        // One group, then the count of bounding entities; entity 2 has no group.
        (4, 8) => 's',
        (2.., 9) => 's',
        _ => 'i',
    });
    put("Nodes", &|l, w| match (l, w) {
        (0, _) | (1, 3) | (2..=13, _) => 's',
        (1, _) => 'i',
        _ => 'd',
    });
    put("Elements", &|l, w| if [1, 3, 5, 7, 9].contains(&l) && w < 3 { 'i' } else { 's' });
    out
}

/// Numbers of the elements of a group.
fn labels(mesh: &Mesh, dimension: u8, name: &str) -> Vec<u32> {
    let of = &mesh.groups[&(dimension, name.to_owned())];
    of.iter().map(|&e| mesh.elements[e as usize].label).collect()
}

fn check_two(mesh: &Mesh) {
    assert_eq!([mesh.points.len(), mesh.elements.len(), mesh.left_out], [12, 5, 1]);
    assert_eq!(mesh.points[6], DVec3::splat(1e-3));
    assert_eq!(labels(mesh, 3, "concrete core"), [5, 6]);
    assert_eq!(labels(mesh, 2, "left"), [3]);
    assert_eq!(labels(mesh, 1, "bar"), [2]);
    assert_eq!(labels(mesh, 0, "corner"), [1]);
    let hex = mesh.elements.iter().find(|e| e.label == 6).unwrap();
    assert_eq!((hex.dimension, hex.nodes.as_slice()), (3, &[1, 8, 9, 2, 5, 10, 11, 6][..]));
}

#[test]
fn text_and_binary_say_the_same() {
    let text = parse_text(TWO).unwrap();
    check_two(&text);
    assert_eq!(read(&binary(), Units::MillimetreNewton).unwrap(), text);
}

/// Version 2.2 repeats an element for every group; here it is one of both.
#[test]
fn version_two_is_read() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 3 \"left\"\n3 1 \"c\"\n3 2 \"d\"\n$EndPhysicalNames\n$Nodes\n8\n\
        1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n$EndNodes\n\
        $Elements\n3\n1 3 2 3 1 1 4 8 5\n2 5 2 1 1 1 2 3 4 5 6 7 8\n3 5 2 2 1 1 2 3 4 5 6 7 8\n$EndElements\n\
        $NodeData\n1\n\"nothing\"\n$EndNodeData\n";
    let mesh = parse_text(text).unwrap();
    assert_eq!(mesh.elements.len(), 2);
    assert_eq!(labels(&mesh, 3, "c"), [2]);
    assert_eq!(labels(&mesh, 3, "d"), [2]);
    assert_eq!(labels(&mesh, 2, "left"), [1]);
}

/// Middles of edges in the order of Abaqus, whichever way Gmsh numbers them (its manual, "Node
/// ordering"): every node lies between the ends of the edge that Abaqus gives it.
#[test]
fn middles_of_edges_are_renumbered() {
    for (kind, solid) in [(11, TET), (17, HEX), (18, WEDGE)] {
        let corners = solid.parts[0].len();
        let order = Kind(kind).order().unwrap();
        assert_eq!(order.len(), corners + solid.abaqus.len());
        assert_eq!(Kind(kind).nodes(), Some(order.len()));
        for (edge, &at) in solid.abaqus.iter().zip(&order[corners..]) {
            let [mut a, mut b] = [*edge, solid.gmsh[at - corners]];
            a.sort_unstable();
            b.sort_unstable();
            assert_eq!(a, b, "{kind}");
        }
    }
}

#[test]
fn flaws_are_named_with_their_line() {
    for (from, to, expected) in [
        ("4.1 0 8", "4.0 0 8", "a.msh:2: version \"4.0\": 4.1 and 2.2 are supported"),
        ("4.1 0 8", "4.1 2 8", "the file type is \"2\""),
        ("4.1 0 8", "2.2 1 8", "read as text only"),
        ("1 12 1 12", "1 99999999999 1 12", "99999999999 are too many"),
        ("1 12 1 12", "1 13 1 13", "13 nodes are announced, 12 are here"),
        ("1 12 1 12", "1 90000 1 12", "the file ends before"),
        ("\n0 0 1\n", "\n0 nan 1\n", "a.msh:38: \"nan\" is not a finite number"),
        (
            "6 2 9 10 3 6 11 12 7",
            "6 2 9 10 3 6 11 12 77",
            "a.msh:59: element 6: node 77 is not defined",
        ),
        ("6 2 9 10 3 6 11 12 7", "6 -2 9 10 3 6 11 12 7", "\"-2\" is not a number of a node"),
        ("3 1 5 2\n", "3 1 4 2\n", "a.msh:59: "),
        ("3 1 5 2\n", "3 1 999 2\n", "element type 999 is not known"),
        ("$EndNodes", "$EndNode", "$EndNodes must"),
        ("$Elements", "$Element", "has no $EndElement"),
        ("\n2\n3\n", "\n2\n2\n", "node 2 is defined twice"),
    ] {
        assert!(TWO.contains(from), "{from}");
        let error = parse_text(&TWO.replacen(from, to, 1)).unwrap_err();
        assert!(
            error.starts_with("a.msh") && error.contains(expected) && error.lines().count() == 1,
            "{from} → {to}: {error}"
        );
    }
}

/// Each type once, however many there are of it, and the node that is not there.
#[test]
fn all_that_is_not_read_is_named() {
    let pyramids = TWO
        .replace("5 1 2 3 4 5 6 7 8\n6 2 9 10 3 6 11 12 7", "5 1 2 3 4 5\n6 2 9 10 3 6")
        .replace("3 1 5 2", "3 1 7 2")
        .replace("2 1 7\n", "2 1 77\n");
    let error = parse_text(&pyramids).unwrap_err();
    assert!(error.starts_with("a.msh:52: element 2: node 77 is not defined"), "{error}");
    assert!(error.contains("line 58: element 5: type 7 (pyramid of 5 nodes)"), "{error}");
    assert_eq!(error.matches("is not supported").count(), 1, "{error}");
}

#[test]
fn garbage_and_halves_are_refused() {
    let bytes = binary();
    let read = |bytes: &[u8]| read(bytes, Units::MetreNewton);
    assert!(read(b"").unwrap_err().contains("a.msh:1: the file ends here"));
    assert!(read(b"solid").unwrap_err().contains("\"solid\" stands here, but $MeshFormat must"));
    for cut in 0..TWO.len() - 1 {
        let whole = TWO[..cut].trim_end().ends_with("$EndElements");
        assert!(read(&TWO.as_bytes()[..cut]).is_err() || whole, "text cut at {cut}");
    }
    for cut in 0..bytes.len() - 1 {
        let whole = bytes[..cut].trim_ascii_end().ends_with(b"$EndElements");
        assert!(read(&bytes[..cut]).is_err() || whole, "binary cut at {cut}");
    }
}

/// As for decks: an answer always, in one line. Seeds are fixed.
#[test]
fn mutated_meshes_never_panic() {
    let originals = [TWO.as_bytes().to_vec(), binary()];
    let mut accepted = 0;
    for case in 0..6000u64 {
        let key = Key::new(12, case);
        let mut file = originals[case as usize % 2].clone();
        for m in 0..1 + key.bits(0) % 3 {
            let draw = |d: u32| key.bits(10 + 10 * m + d) as usize;
            let at = draw(0) % file.len();
            match draw(1) % 4 {
                0 => file[at] ^= 1 << (draw(2) % 8),
                1 => drop(file.drain(at..(at + 1 + draw(2) % 8).min(file.len()))),
                2 => file[at] = [0, 0xff, b'9', b'-', b' ', b'\n'][draw(2) % 6],
                _ => {
                    let part: Vec<u8> = file[at..(at + 1 + draw(2) % 40).min(file.len())].to_vec();
                    let to = draw(3) % file.len();
                    file.splice(to..to, part);
                }
            }
        }
        match read(&file, Units::MetreNewton) {
            Ok(mesh) => {
                accepted += 1;
                let count = mesh.points.len() as u32;
                assert!(mesh.elements.iter().all(|e| e.nodes.iter().all(|&n| n < count)));
            }
            Err(error) => assert_eq!(error.lines().count(), 1, "{error}"),
        }
    }
    assert!(accepted > 100, "{accepted}");
}
