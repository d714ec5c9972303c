//! What `cargo generate` writes is what is built here.

use std::path::Path;

#[test]
fn the_manifest_with_places_to_fill_is_this_one() {
    let read = |name: &str| {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        std::fs::read_to_string(place).expect("a file of the example")
    };
    let filled = read("template/manifest.toml")
        .replace("{{project-name}}", "work-light")
        .replace("{{checkout}}", "../..");
    assert_eq!(filled, read("Cargo.toml"));
}
