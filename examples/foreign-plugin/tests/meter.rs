//! The plugin in a whole app, without a window.

use intrados_scene::Meter;
use work_light::{METER, WorkLight, WorkLightPlugin, read};

/// The two sides of the meter are two independent estimates of one number: |z| < 4.5 fails by
/// chance once in 150 000 seeds, and the seed is fixed.
#[test]
fn the_meter_is_read_from_both_sides() {
    let mut app = intrados::simulation();
    app.add_plugins(WorkLightPlugin::default());
    let light = read(&mut app, "room".into(), 40).expect("a bundled scene opens");
    let (lux, error) = light.lux.expect("it was read");
    assert!(lux > 0.0 && error < 0.05 * lux, "{lux} ± {error} lx");
    assert!(light.duality_z.expect("two sides").abs() < 4.5, "{light:?}");
}

#[test]
fn the_meter_goes_with_its_scene() {
    let mut app = intrados::simulation();
    app.add_plugins(WorkLightPlugin::default());
    for scene in ["room", "cornell"] {
        read(&mut app, scene.into(), 2).expect("a bundled scene opens");
    }
    let ours = app.world_mut().query::<&Meter>().iter(app.world()).filter(|m| m.name == METER).count();
    assert_eq!(ours, 1);
}

#[test]
fn a_limit_within_the_error_bar_is_not_decided() {
    let light = |lux, error| WorkLight { needed: 300.0, lux: Some((lux, error)), duality_z: None };
    assert_eq!(light(310.0, 5.0).is_enough(), None);
    assert_eq!(light(310.0, 1.0).is_enough(), Some(true));
    assert_eq!(light(200.0, 1.0).is_enough(), Some(false));
}

#[test]
fn a_scene_that_is_not_there_is_an_error() {
    let mut app = intrados::simulation();
    app.add_plugins(WorkLightPlugin::default());
    let error = read(&mut app, "no/such/scene.ron".into(), 1).expect_err("there is none");
    assert!(error.to_string().contains("no/such/scene.ron"), "{error}");
}
