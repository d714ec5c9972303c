//! Which panels are open and where: two layouts of tiles that a user drags about, kept from one
//! session to the next.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use bevy_ecs::prelude::*;
use egui::{Rect, ScrollArea, Ui, WidgetText};
use egui_tiles::{
    Behavior, Container, EditAction, Linear, LinearDir, SimplificationOptions, Tile, TileId, Tiles,
    Tree, UiResponse,
};
use serde::{Deserialize, Serialize};

use crate::{
    Colours, Language, Lengths, Place, kept,
    lang::{self, term},
    lengths,
    place::{Panel, Panels},
    scale::Ranges,
};

/// Schema of the file.
const SCHEMA: &str = "intrados.layout/1";
/// So deep may tiles lie in each other.
const DEEPEST: usize = 32;
/// Panels of ours that only experts open: what walks do, and how well.
const EXPERT: [&str; 8] =
    ["Render", "Inspector", "Meters", "Directions", "Convergence", "Steering", "Jobs", "Log"];
/// Width that a member's sheet wants, points, and its bounds as shares of the window.
const SHEET: (f32, f32, f32) = (322.0, 0.25, 0.36);

/// The language of the window where nobody has chosen one: the system's, as far as the app knows it.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct SystemLanguage(pub(crate) Language);

/// Two ways to arrange the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Workspace {
    /// The structure, and beside it the sheet of a member.
    #[default]
    Inspector,
    /// All of it: estimators, meters, fields, convergence.
    Expert,
}

impl Workspace {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::Inspector, Self::Expert];

    /// Its name, for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Inspector => "Inspector",
            Self::Expert => "Expert",
        }
    }

    pub(crate) fn other(self) -> Self {
        match self {
            Self::Inspector => Self::Expert,
            Self::Expert => Self::Inspector,
        }
    }
}

/// Where panels lie. A tile is a panel's name.
#[derive(Debug, Clone)]
struct Laid {
    tree: Tree<String>,
    /// Panels that the user has been offered: one that came later is added, one that was closed
    /// stays closed.
    offered: BTreeSet<String>,
}

/// What is kept in a file.
#[derive(Serialize, Deserialize)]
struct Kept {
    schema: String,
    chosen: Workspace,
    #[serde(default)]
    theme: Theme,
    /// None: as the system has it.
    #[serde(default)]
    language: Option<Language>,
    #[serde(default)]
    lengths: Lengths,
    #[serde(default)]
    colours: Colours,
    #[serde(default)]
    ranges: Ranges,
    /// Pictures that are compared have each their own place and size.
    #[serde(default)]
    unlinked: bool,
    inspector: Option<KeptLayout>,
    expert: Option<KeptLayout>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KeptLayout {
    root: Option<Node>,
    offered: BTreeSet<String>,
}

/// A tile and what lies in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Node {
    Panel(String),
    /// Behind each other; which of them is in front.
    Tabs(Vec<Node>, usize),
    /// From left to right, with their shares of the width.
    Row(Vec<(f32, Node)>),
    /// From above to below, with their shares of the height.
    Column(Vec<(f32, Node)>),
}

/// Light, dark, or as the system has it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Theme {
    #[default]
    System,
    Light,
    Dark,
}

impl From<egui::ThemePreference> for Theme {
    fn from(theme: egui::ThemePreference) -> Self {
        match theme {
            egui::ThemePreference::System => Self::System,
            egui::ThemePreference::Light => Self::Light,
            egui::ThemePreference::Dark => Self::Dark,
        }
    }
}

impl From<Theme> for egui::ThemePreference {
    fn from(theme: Theme) -> Self {
        match theme {
            Theme::System => Self::System,
            Theme::Light => Self::Light,
            Theme::Dark => Self::Dark,
        }
    }
}

impl Laid {
    fn kept(&self) -> KeptLayout {
        let root = self.tree.root().and_then(|root| node(&self.tree.tiles, root));
        KeptLayout { root, offered: self.offered.clone() }
    }

    /// None where it is deeper than anybody would dock.
    fn of(kept: KeptLayout, workspace: Workspace) -> Option<Self> {
        let mut tiles = Tiles::default();
        let root = match &kept.root {
            Some(root) if root.depth() <= DEEPEST => Some(planted(&mut tiles, root)),
            Some(_) => return None,
            None => None,
        };
        let id = id_of(workspace);
        let tree = root.map_or_else(|| Tree::empty(id), |root| Tree::new(id, root, tiles));
        Some(Self { tree, offered: kept.offered })
    }
}

impl Node {
    fn depth(&self) -> usize {
        let below = match self {
            Self::Panel(_) => None,
            Self::Tabs(nodes, _) => nodes.iter().map(Self::depth).max(),
            Self::Row(nodes) | Self::Column(nodes) => nodes.iter().map(|n| n.1.depth()).max(),
        };
        1 + below.unwrap_or(0)
    }
}

/// A tile as it is kept.
fn node(tiles: &Tiles<String>, id: TileId) -> Option<Node> {
    let all = |ids: &[TileId]| ids.iter().filter_map(|id| node(tiles, *id)).collect();
    Some(match tiles.get(id)? {
        Tile::Pane(name) => Node::Panel(name.clone()),
        Tile::Container(Container::Tabs(tabs)) => {
            let front = tabs.children.iter().position(|c| Some(*c) == tabs.active);
            Node::Tabs(all(&tabs.children), front.unwrap_or(0))
        }
        Tile::Container(Container::Linear(linear)) => {
            let child = |id: &TileId| Some((linear.shares[*id], node(tiles, *id)?));
            let children = linear.children.iter().filter_map(child).collect();
            match linear.dir {
                LinearDir::Horizontal => Node::Row(children),
                LinearDir::Vertical => Node::Column(children),
            }
        }
        Tile::Container(Container::Grid(grid)) => {
            let ids: Vec<TileId> = grid.children().copied().collect();
            Node::Row(all(&ids).into_iter().map(|node| (1.0, node)).collect())
        }
    })
}

/// A tile of what was kept.
fn planted(tiles: &mut Tiles<String>, node: &Node) -> TileId {
    match node {
        Node::Panel(name) => tiles.insert_pane(name.clone()),
        Node::Tabs(nodes, front) => {
            let children: Vec<TileId> = nodes.iter().map(|n| planted(tiles, n)).collect();
            let mut tabs = egui_tiles::Tabs::new(children.clone());
            tabs.active = children.get(*front).or(children.first()).copied();
            tiles.insert_container(tabs)
        }
        Node::Row(nodes) | Node::Column(nodes) => {
            let is_row = matches!(node, Node::Row(_));
            let dir = if is_row { LinearDir::Horizontal } else { LinearDir::Vertical };
            let children: Vec<TileId> = nodes.iter().map(|n| planted(tiles, &n.1)).collect();
            let sound = |share: f32| if share.is_finite() { share.clamp(0.01, 100.0) } else { 1.0 };
            let shares: Vec<f32> = nodes.iter().map(|n| sound(n.0)).collect();
            linear(tiles, dir, &children, &shares)
        }
    }
}

fn id_of(workspace: Workspace) -> egui::Id {
    egui::Id::unique(("workspace", workspace.name()))
}

/// The layouts, and which of them is shown.
#[derive(Resource, Default)]
pub(crate) struct Desk {
    /// What the user wants to see of structures.
    chosen: Workspace,
    /// What is shown: of a scene without members there is no sheet.
    shown: Workspace,
    laid: [Option<Laid>; 2],
    file: Option<PathBuf>,
    /// Panels that were drawn in the last frame, and where.
    drawn: BTreeMap<String, Rect>,
    /// Panels that are to be brought to the front in the next.
    wanted: Vec<String>,
    theme: egui::ThemePreference,
    /// None: as the system has it.
    language: Option<Language>,
    /// In which unit lengths are written.
    lengths: Lengths,
    /// How numbers become colours.
    scales: (Colours, Ranges),
    /// Pictures that are compared have each their own place and size.
    unlinked: bool,
    /// Whether the theme has been put on.
    is_dressed: bool,
    is_changed: bool,
}

impl Desk {
    /// As it was left; where nothing was, or nothing that makes sense, as it is at first.
    pub(crate) fn read(file: Option<PathBuf>) -> Self {
        let kept: Option<Kept> = file.as_deref().and_then(kept::read);
        let kept = kept.filter(|k| k.schema == SCHEMA);
        let unlinked = kept.as_ref().is_some_and(|k| k.unlinked);
        let (chosen, theme, words, scales, laid) = kept.map_or_else(Default::default, |k| {
            let of = |kept: Option<KeptLayout>, workspace| Laid::of(kept?, workspace);
            let expert = of(k.expert, Workspace::Expert);
            let laid = [of(k.inspector, Workspace::Inspector), expert];
            let words = (k.language, k.lengths);
            (k.chosen, k.theme.into(), words, (k.colours, k.ranges), laid)
        });
        let (shown, (language, lengths)) = (chosen, words);
        let words = Self { language, lengths, scales, unlinked, ..Self::default() };
        Self { chosen, shown, theme, laid, file, ..words }
    }

    fn write(&self) {
        let Some(file) = &self.file else { return };
        let [inspector, expert] = &self.laid;
        let [inspector, expert] = [inspector, expert].map(|l| l.as_ref().map(Laid::kept));
        let (schema, chosen, theme) = (SCHEMA.into(), self.chosen, self.theme.into());
        let (language, lengths) = (self.language, self.lengths);
        let (colours, ranges) = self.scales.clone();
        let unlinked = self.unlinked;
        let kept = Kept {
            schema,
            chosen,
            theme,
            language,
            lengths,
            colours,
            ranges,
            unlinked,
            inspector,
            expert,
        };
        kept::write(file, "the layout was", &kept);
    }

    pub(crate) fn shown(&self) -> Workspace {
        self.shown
    }

    /// Goes to a layout, from now on.
    pub(crate) fn choose(&mut self, workspace: Workspace) {
        (self.chosen, self.shown, self.is_changed) = (workspace, workspace, true);
    }

    /// Another scene: without members there is nothing to inspect.
    pub(crate) fn adapt(&mut self, has_members: bool) {
        self.shown = if has_members { self.chosen } else { Workspace::Expert };
    }

    /// Shows the picture of light, where it lies.
    pub(crate) fn light(&mut self) {
        self.shown = Workspace::Expert;
        self.open("Render");
    }

    /// Light or dark, from now on.
    pub(crate) fn dress(&mut self, theme: egui::ThemePreference) {
        (self.theme, self.is_dressed, self.is_changed) = (theme, false, true);
    }

    pub(crate) fn theme(&self) -> egui::ThemePreference {
        self.theme
    }

    /// One language, from now on.
    pub(crate) fn speak(&mut self, language: Language) {
        (self.language, self.is_changed) = (Some(language), true);
    }

    /// The language that the user has chosen; none: as the system has it.
    pub(crate) fn language(&self) -> Option<Language> {
        self.language
    }

    /// One unit of lengths, from now on.
    pub(crate) fn measure_in(&mut self, lengths: Lengths) {
        (self.lengths, self.is_changed) = (lengths, true);
    }

    /// In which unit lengths are written.
    pub(crate) fn lengths(&self) -> Lengths {
        self.lengths
    }

    /// Whether pictures that are compared are seen from one place, and equally enlarged.
    pub(crate) fn links(&self) -> bool {
        !self.unlinked
    }

    /// Links pictures that are compared, or lets each go its own way.
    pub(crate) fn swap_links(&mut self) {
        (self.unlinked, self.is_changed) = (!self.unlinked, true);
    }

    /// How numbers became colours when that was last kept.
    pub(crate) fn scales(&self) -> (Colours, Ranges) {
        self.scales.clone()
    }

    /// How they do now.
    pub(crate) fn keep(&mut self, colours: Colours, ranges: &Ranges) {
        if (self.scales.0, &self.scales.1) != (colours, ranges) {
            (self.scales, self.is_changed) = ((colours, ranges.clone()), true);
        }
    }

    /// The theme that is to be put on now, if one is.
    fn undressed(&mut self) -> Option<egui::ThemePreference> {
        (!std::mem::replace(&mut self.is_dressed, true)).then_some(self.theme)
    }

    /// As at first.
    pub(crate) fn reset(&mut self) {
        self.laid[self.shown as usize] = None;
        self.is_changed = true;
    }

    /// Whether a panel was seen in the last frame.
    pub(crate) fn has_drawn(&self, name: &str) -> bool {
        self.drawn.contains_key(name)
    }

    /// Panels that were seen in the last frame.
    pub(crate) fn in_sight(&self) -> Vec<String> {
        self.drawn.keys().cloned().collect()
    }

    /// Whether a panel is to be brought to the front that was not seen in the last frame.
    pub(crate) fn is_turning(&self) -> bool {
        self.wanted.iter().any(|name| !self.drawn.contains_key(name))
    }

    /// Where a panel was in the last frame.
    pub(crate) fn place(&self, name: &str) -> Option<Rect> {
        self.drawn.get(name).copied()
    }

    /// Whether a panel lies somewhere, seen or behind another.
    pub(crate) fn is_open(&self, name: &str) -> bool {
        let laid = self.laid[self.shown as usize].as_ref();
        laid.is_some_and(|l| l.tree.tiles.find_pane(&name.to_owned()).is_some())
    }

    /// Brings a panel to the front, and opens it where it is not open.
    pub(crate) fn open(&mut self, name: &str) {
        self.wanted.push(name.to_owned());
    }

    pub(crate) fn close(&mut self, name: &str) {
        let Some(laid) = &mut self.laid[self.shown as usize] else { return };
        if let Some(tile) = laid.tree.tiles.find_pane(&name.to_owned()) {
            laid.tree.remove_recursively(tile);
            self.is_changed = true;
        }
    }
}

/// Brings a panel to the front, and adds it where it is not there.
fn bring(tree: &mut Tree<String>, name: &str) {
    if tree.tiles.find_pane(&name.to_owned()).is_none() {
        add(tree, name);
    }
    tree.make_active(|_, tile| matches!(tile, Tile::Pane(pane) if pane == name));
}

/// Adds a panel to the largest group of tabs.
fn add(tree: &mut Tree<String>, name: &str) {
    let size = |tile: &Tile<String>| match tile {
        Tile::Container(Container::Tabs(tabs)) => Some(tabs.children.len()),
        _ => None,
    };
    // The first of the largest: tiles come in no order of their own.
    let most = tree.tiles.iter().filter_map(|(id, tile)| Some((size(tile)?, *id)));
    let group = most.max_by_key(|(size, id)| (*size, std::cmp::Reverse(id.0))).map(|(_, id)| id);
    let pane = tree.tiles.insert_pane(name.to_owned());
    match group.and_then(|id| tree.tiles.get_mut(id)) {
        Some(Tile::Container(container)) => container.add_child(pane),
        _ => {
            let tabs = tree.tiles.insert_tab_tile(vec![pane]);
            let children = tree.root().into_iter().chain([tabs]).collect();
            tree.root = Some(tree.tiles.insert_horizontal_tile(children));
        }
    }
}

/// How panels lie at first, in a window so wide.
fn first(workspace: Workspace, panels: &[Panel], width: f32) -> Tree<String> {
    let mut tiles = Tiles::default();
    let at = |place: Place| -> Vec<String> {
        let fits = |p: &&Panel| {
            p.place == place
                && (workspace == Workspace::Expert || !EXPERT.contains(&p.name.as_str()))
        };
        panels.iter().filter(fits).map(|p| p.name.clone()).collect()
    };
    let [left, right, bottom, mut centre] =
        [Place::Left, Place::Right, Place::Bottom, Place::Tab].map(at);
    let id = id_of(workspace);
    match workspace {
        Workspace::Inspector => {
            // What others put at the bottom is a tab here.
            centre.extend(bottom);
            let (own, theirs): (Vec<String>, Vec<String>) =
                right.into_iter().partition(|n| n == "Member");
            let column = [left, own, theirs].into_iter().filter(|group| !group.is_empty());
            let column: Vec<TileId> = column.map(|group| tabs(&mut tiles, group)).collect();
            let centre = tabs(&mut tiles, centre);
            let side = column_of(&mut tiles, &column, &[0.32, 0.68, 0.3]);
            let (wanted, least, most) = SHEET;
            let share = (wanted / width.max(1.0)).clamp(least, most);
            let root = Linear::new_binary(LinearDir::Horizontal, [centre, side], 1.0 - share);
            let root = tiles.insert_container(root);
            Tree::new(id, root, tiles)
        }
        Workspace::Expert => {
            // Where light is looked at, the picture comes first.
            if let Some(render) = centre.iter().position(|n| n == "Render") {
                let render = centre.remove(render);
                centre.insert(0, render);
            }
            // The sheet lies behind the inspector.
            let (mut sheet, mut right): (Vec<String>, Vec<String>) =
                right.into_iter().partition(|n| n == "Member");
            if !right.is_empty() {
                sheet.insert(0, right.remove(0));
            }
            let groups = [sheet].into_iter().chain(right.into_iter().map(|name| vec![name]));
            let groups = groups.filter(|group| !group.is_empty());
            let right: Vec<TileId> = groups.map(|group| tabs(&mut tiles, group)).collect();
            let right = column_of(&mut tiles, &right, &[0.44, 0.34, 0.22, 0.2]);
            let [left, bottom, centre] =
                [left, bottom, centre].map(|group| tabs(&mut tiles, group));
            let shares = [0.2, 0.58, 0.22];
            let row = row_of(&mut tiles, &[left, centre, right], &shares);
            let root = Linear::new_binary(LinearDir::Vertical, [row, bottom], 0.72);
            let root = tiles.insert_container(root);
            Tree::new(id, root, tiles)
        }
    }
}

/// Tabs, of which the first is in front.
fn tabs(tiles: &mut Tiles<String>, names: Vec<String>) -> TileId {
    let panes: Vec<TileId> = names.into_iter().map(|name| tiles.insert_pane(name)).collect();
    tiles.insert_tab_tile(panes)
}

fn column_of(tiles: &mut Tiles<String>, children: &[TileId], shares: &[f32]) -> TileId {
    linear(tiles, LinearDir::Vertical, children, shares)
}

fn row_of(tiles: &mut Tiles<String>, children: &[TileId], shares: &[f32]) -> TileId {
    linear(tiles, LinearDir::Horizontal, children, shares)
}

fn linear(
    tiles: &mut Tiles<String>,
    dir: LinearDir,
    children: &[TileId],
    shares: &[f32],
) -> TileId {
    let mut linear = Linear::new(dir, children.to_vec());
    children.iter().zip(shares).for_each(|(child, share)| linear.shares.set_share(*child, *share));
    tiles.insert_container(linear)
}

/// A layout with the panels that there are: those that came with a plugin since it was left, and
/// without those that went.
fn settled(laid: Option<Laid>, workspace: Workspace, panels: &[Panel], width: f32) -> Laid {
    let offered = || panels.iter().map(|p| p.name.clone()).collect();
    let Some(mut laid) = laid else {
        return Laid { tree: first(workspace, panels, width), offered: offered() };
    };
    let gone: Vec<TileId> = laid
        .tree
        .tiles
        .iter()
        .filter(
            |(_, tile)| matches!(tile, Tile::Pane(name) if panels.iter().all(|p| p.name != *name)),
        )
        .map(|(id, _)| *id)
        .collect();
    for tile in gone {
        laid.tree.remove_recursively(tile);
    }
    for panel in panels.iter().filter(|p| !laid.offered.contains(&p.name)) {
        if workspace == Workspace::Expert || !EXPERT.contains(&panel.name.as_str()) {
            add(&mut laid.tree, &panel.name);
        }
    }
    laid.offered = offered();
    laid
}

/// Speaks the language that was chosen, else the system's, and writes lengths in the unit that was
/// chosen.
pub(crate) fn speak(world: &World) {
    let system = world.resource::<SystemLanguage>().0;
    let desk = world.resource::<Desk>();
    lang::speak(desk.language().unwrap_or(system));
    lengths::choose(desk.lengths());
}

/// Puts the theme on, once it is another one; small print is to be read without a lens.
pub(crate) fn dress(ui: &Ui, world: &mut World) {
    let Some(theme) = world.resource_mut::<Desk>().bypass_change_detection().undressed() else {
        return;
    };
    ui.ctx().set_theme(theme);
    ui.ctx().all_styles_mut(|style| {
        if let Some(small) = style.text_styles.get_mut(&egui::TextStyle::Small) {
            small.size = small.size.max(12.0);
        }
    });
}

/// Draws a panel in its tile.
type Run<'a> = &'a mut dyn FnMut(&Panel, &mut Ui, &mut World);

struct Tiling<'a> {
    world: &'a mut World,
    panels: &'a [Panel],
    run: Run<'a>,
    drawn: BTreeMap<String, Rect>,
    is_edited: bool,
}

impl Behavior<String> for Tiling<'_> {
    fn tab_title_for_pane(&mut self, name: &String) -> WidgetText {
        term(name).into()
    }

    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, name: &mut String) -> UiResponse {
        let Some(panel) = self.panels.iter().find(|p| p.name == *name) else {
            return UiResponse::None;
        };
        self.drawn.insert(name.clone(), ui.max_rect());
        let picture = name == "Structure";
        let margin = if picture { 0 } else { 6 };
        let frame = egui::Frame::new().inner_margin(egui::Margin::same(margin));
        frame.fill(ui.visuals().panel_fill).show(ui, |ui| {
            // A frame is as large as its tile, however little is in it.
            ui.set_min_size(ui.available_size());
            // What is written from above to below is scrolled; pictures and tables do it themselves.
            match panel.place {
                Place::Left | Place::Right => {
                    let area = ScrollArea::vertical().id_salt(name.as_str()).auto_shrink(false);
                    area.show(ui, |ui| (self.run)(panel, ui, self.world));
                }
                Place::Bottom | Place::Tab => (self.run)(panel, ui, self.world),
            }
        });
        UiResponse::None
    }

    fn is_tab_closable(&self, _: &Tiles<String>, _: TileId) -> bool {
        true
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..Default::default() }
    }

    fn gap_width(&self, _: &egui::Style) -> f32 {
        3.0
    }

    fn on_edit(&mut self, _: EditAction) {
        self.is_edited = true;
    }
}

/// Draws the layout that is shown.
pub(crate) fn show(ui: &mut Ui, world: &mut World, run: Run<'_>) {
    let panels = world.resource::<Panels>().0.clone();
    let mut desk = world.resource_mut::<Desk>();
    let workspace = desk.shown;
    let laid = desk.laid[workspace as usize].take();
    let wanted = std::mem::take(&mut desk.wanted);
    let mut laid = settled(laid, workspace, &panels, ui.available_width());
    for name in wanted.iter().filter(|name| panels.iter().any(|p| p.name == **name)) {
        bring(&mut laid.tree, name);
    }
    let mut tiling =
        Tiling { world, panels: &panels, run, drawn: BTreeMap::new(), is_edited: false };
    if laid.tree.root().is_none() {
        ui.centered_and_justified(|ui| {
            ui.weak(tr!("All panels are closed. View ▸ Panels opens them again."))
        });
    }
    laid.tree.ui(&mut tiling, ui);
    let (drawn, is_edited) = (tiling.drawn, tiling.is_edited);
    let mut desk = world.resource_mut::<Desk>();
    let desk = &mut *desk;
    // Whoever asked for another layout meanwhile has asked for the next frame's.
    desk.laid[workspace as usize] = Some(laid);
    desk.drawn = drawn;
    desk.is_changed |= is_edited || !wanted.is_empty();
    if desk.is_changed && !ui.input(|i| i.pointer.any_down()) {
        desk.is_changed = false;
        desk.write();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panels() -> Vec<Panel> {
        let mut world = World::new();
        let nothing = world.register_system(IntoSystem::into_system(|_: InMut<Ui>| {}));
        let panel = |place, name: &str| Panel { place, name: name.to_owned(), system: nothing };
        vec![
            panel(Place::Left, "Members"),
            panel(Place::Right, "Member"),
            panel(Place::Right, "Meters"),
            panel(Place::Bottom, "Log"),
            panel(Place::Tab, "Structure"),
            panel(Place::Tab, "Render"),
        ]
    }

    fn names(laid: &Laid) -> BTreeSet<String> {
        let pane = |tile: &Tile<String>| match tile {
            Tile::Pane(name) => Some(name.clone()),
            Tile::Container(_) => None,
        };
        laid.tree.tiles.tiles().filter_map(pane).collect()
    }

    #[test]
    fn an_inspector_sees_no_estimators_and_an_expert_all() {
        let panels = panels();
        let inspector = settled(None, Workspace::Inspector, &panels, 1280.0);
        assert_eq!(names(&inspector), ["Member", "Members", "Structure"].map(String::from).into());
        let expert = settled(None, Workspace::Expert, &panels, 1280.0);
        assert_eq!(names(&expert).len(), panels.len());
        // What is kept of a layout is all of it.
        let kept = expert.kept();
        let again = Laid::of(kept.clone(), Workspace::Expert).unwrap();
        assert_eq!(again.kept(), kept);
    }

    #[test]
    fn a_closed_panel_stays_closed_and_a_new_one_is_added() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layout.json");
        let mut panels = panels();
        let mut desk = Desk::read(Some(file.clone()));
        desk.laid[0] = Some(settled(None, Workspace::Inspector, &panels, 1280.0));
        desk.close("Members");
        desk.choose(Workspace::Expert);
        desk.write();
        let mut again = Desk::read(Some(file.clone()));
        assert_eq!(again.shown(), Workspace::Expert);
        panels.push(Panel { name: "Dose".into(), ..panels[4].clone() });
        let laid = settled(again.laid[0].take(), Workspace::Inspector, &panels, 1280.0);
        assert_eq!(names(&laid), ["Dose", "Member", "Structure"].map(String::from).into());
        // And one whose plugin is gone goes.
        panels.retain(|p| p.name != "Member");
        let laid = settled(Some(laid), Workspace::Inspector, &panels, 1280.0);
        assert_eq!(names(&laid), ["Dose", "Structure"].map(String::from).into());
    }

    #[test]
    fn a_language_that_was_chosen_is_kept_and_a_file_without_one_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layout.json");
        let mut desk = Desk::read(Some(file.clone()));
        assert_eq!(desk.language(), None);
        desk.speak(Language::German);
        desk.choose(Workspace::Expert);
        desk.write();
        let again = Desk::read(Some(file.clone()));
        assert_eq!((again.language(), again.shown()), (Some(Language::German), Workspace::Expert));
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replace("  \"language\": \"german\",\n", "")).unwrap();
        let again = Desk::read(Some(file));
        assert_eq!((again.language(), again.shown()), (None, Workspace::Expert));
    }

    #[test]
    fn a_unit_of_lengths_is_kept_and_a_file_without_one_has_metres() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layout.json");
        let mut desk = Desk::read(Some(file.clone()));
        assert_eq!(desk.lengths(), Lengths::Metres);
        desk.measure_in(Lengths::FeetAndInches);
        desk.write();
        assert_eq!(Desk::read(Some(file.clone())).lengths(), Lengths::FeetAndInches);
        let text = std::fs::read_to_string(&file).unwrap();
        let without = text.replace("  \"lengths\": \"feet_and_inches\",\n", "");
        assert_ne!(without, text);
        std::fs::write(&file, without).unwrap();
        assert_eq!(Desk::read(Some(file)).lengths(), Lengths::Metres);
    }

    #[test]
    fn pictures_are_linked_until_somebody_parts_them_and_that_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layout.json");
        let mut desk = Desk::read(Some(file.clone()));
        assert!(desk.links());
        desk.write();
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, text.replace("  \"unlinked\": false,\n", "")).unwrap();
        assert!(Desk::read(Some(file.clone())).links());
        desk.swap_links();
        desk.write();
        assert!(!Desk::read(Some(file)).links());
    }

    #[test]
    fn a_file_that_makes_no_sense_is_no_layout() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("layout.json");
        let desk = Desk::read(Some(file.clone()));
        desk.write();
        let text = std::fs::read_to_string(&file).unwrap();
        // Deeper than a stack would bear, were it built.
        let deep = "{\"tabs\":[[".repeat(60) + "{\"panel\":\"Log\"}" + &"],0]}".repeat(60);
        let inspector = format!("\"inspector\": {{\"root\": {deep}, \"offered\": []}}");
        std::fs::write(&file, text.replace("\"inspector\": null", &inspector)).unwrap();
        assert!(Desk::read(Some(file.clone())).laid[0].is_none());
        std::fs::write(&file, "[{").unwrap();
        assert!(Desk::read(Some(file)).laid[0].is_none());
    }
}
