//! Pictures of the structure for files: from where it is looked at, and from all its views.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::Ui;
use intrados_scene::{Camera, Scene};

use super::{
    Structure,
    model::{self, Scale},
    time,
};
use crate::{
    Latest,
    history::History,
    lang::term,
    leaf::{self, Leaf},
    moment::{Courses, Moment, Seen},
    views::Views,
};

/// What is shown, and what of it is said beside it.
struct Print {
    name: String,
    what: String,
    seen: Vec<Seen>,
    scale: Scale,
    camera: Camera,
}

impl Structure {
    /// All members by their damage: from where they are looked at, beside what an earlier prediction
    /// said, from the sides, through the cameras of the scene and from the views that are kept of
    /// it. A section stays, and whoever is selected is no brighter than others.
    pub(crate) fn leaves(&mut self, ui: &Ui, world: &World, scene: &Arc<Scene>) -> Vec<Leaf> {
        self.model.adopt(scene);
        let Some(now) = self.model.sight(scene) else { return Vec::new() };
        let (courses, when) = (world.resource::<Courses>(), *world.resource::<Moment>());
        let seen = when.seen(scene, world.resource::<Latest>(), courses);
        let is_added = when.added && !when.is_now();
        let scale = if is_added { Scale::ADDED } else { Scale::DAMAGE };
        let then = time::told(when.years, &courses.timeline);
        let mut prints = Vec::new();
        for (name, from, camera) in self.sights(scene, world.resource::<Views>(), &now) {
            let what = format!("{from}, {}, {then}", term(scale.name));
            prints.push(Print { name, what, seen: seen.clone(), scale, camera });
        }
        if let Some(earlier) = world.resource::<History>().beside() {
            let (name, what) = ("structure-earlier".into(), earlier.title.clone());
            let (seen, scale) = (earlier.seen(scene), Scale::DAMAGE);
            prints.push(Print { name, what, seen, scale, camera: now });
        }
        prints.into_iter().map(|print| self.leaf(ui, scene, print)).collect()
    }

    /// Where pictures look from, each with the name of its file and what people call it.
    fn sights(&self, scene: &Scene, views: &Views, now: &Camera) -> Vec<(String, String, Camera)> {
        let mut all = vec![("structure".into(), tr!("as it is looked at"), now.clone())];
        for (aspect, name) in [
            (super::Aspect::Front, "front"),
            (super::Aspect::Side, "side"),
            (super::Aspect::Top, "top"),
        ] {
            let camera = self.model.aside(now, aspect.axis());
            all.push((format!("structure-{name}"), aspect.name(), camera));
        }
        let own = scene.cameras.iter().map(|camera| ("camera", camera));
        let kept = views.of(&scene.path).iter().map(|view| ("view", view));
        for (kind, camera) in own.chain(kept) {
            let name = format!("structure-{kind}-{}", camera.name);
            all.push((name, camera.name.clone(), model::sized(camera)));
        }
        all
    }

    fn leaf(&self, ui: &Ui, scene: &Scene, print: Print) -> Leaf {
        let Print { name, what, seen, scale, camera } = print;
        let width = camera.width as usize;
        let what = leaf::said(scene, &what);
        let legend = scale.printed(vec![what.clone()]).drawn(ui, width);
        let draw = self.model.print(seen, scale, self.section, camera, model::ground(ui));
        Leaf { name, what, legend: Some(legend), draw }
    }
}
