//! The photograph and its faces for files, with what was found on them.

use egui::{ColorImage, Ui};
use intrados_scene::Scene;

use super::{Photos, sheet::FOUND, work::Find};
use crate::{
    lang::term,
    leaf::{self, Leaf, on_ground},
};

impl Photos {
    /// The photograph that is looked at, and what it shows of each face without its light.
    pub(crate) fn leaves(&self, ui: &Ui, scene: &Scene) -> Vec<Leaf> {
        let is_of = self.of.as_ref().is_some_and(|(hash, ..)| *hash == scene.hash);
        let Some(Ok(shot)) = self.shot.as_ref().filter(|_| is_of) else { return Vec::new() };
        let photo = &shot.opened.photo;
        let file = photo.file.file_stem().unwrap_or_default().to_string_lossy();
        let ground = ui.visuals().extreme_bg_color;
        let leaf = |name: String, shown: String, image: &ColorImage, lines: Vec<Line>| {
            let image = image.clone();
            Leaf {
                name,
                what: leaf::said(scene, &shown),
                legend: None,
                draw: Box::new(move || {
                    let mut image = on_ground(image, ground);
                    lines.iter().for_each(|line| leaf::mark(&mut image, line, FOUND));
                    image
                }),
            }
        };
        let picture = &shot.opened.picture;
        let across = f64::from(shot.opened.photograph.size[0]);
        let all = shot.faces.iter().flat_map(|(face, _)| &face.finds);
        let in_photo = all.map(|find| scaled(&find.in_photo, across, picture)).collect();
        let mut leaves =
            vec![leaf(format!("photograph-{file}"), photo.name.clone(), picture, in_photo)];
        for (face, _) in &shot.faces {
            let across = f64::from(face.size[0]);
            let on_map = face.finds.iter().map(|f| scaled(&f.on_map, across, &face.picture));
            let shown: Vec<String> = [photo.name.clone(), term(&face.name)]
                .into_iter()
                .chain(face.finds.iter().map(Find::what))
                .collect();
            let name = format!("photograph-{file}-{}", face.name);
            leaves.push(leaf(name, shown.join(", "), &face.picture, on_map.collect()));
        }
        leaves
    }
}

/// Places in a picture, pixels.
type Line = Vec<[f64; 2]>;

/// Places in what is so many pixels across, in its picture, which may be smaller.
fn scaled(line: &[[f64; 2]], across: f64, picture: &ColorImage) -> Line {
    let scale = picture.width() as f64 / across.max(1.0);
    line.iter().map(|at| at.map(|x| scale * x)).collect()
}
