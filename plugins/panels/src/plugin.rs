//! The window's state and its built-in panels, put together.

use std::{path::PathBuf, time::Duration};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_report::pdf;
use intrados_stage::Stage;

use crate::{
    Actions, AddPanel, Banners, Language, Latest, Log, Look, Place, Refine, Selection, Statistics,
    Viewpoint, action, attach, banner, border, command, convergence, create, ct, dialog,
    directions, drops, edits, export, fields, history, inspector, layout, light_line, log,
    machine::MachineSetup, members, meters, moment, outline, photos, picture, place::Panels, play,
    prediction, recent, reference, refine, render, report, saving, session, sheet, smooth,
    statistics, steering, stress, structure, toast, trail, viewpoint, views, workspace,
};

/// Adds the window's state and the built-in panels. It opens no window: whoever has one calls
/// [`show`] in every frame.
#[derive(Debug, Clone, Default)]
pub struct PanelsPlugin {
    /// How long a frame the film may take; `None`: one pass a frame.
    pub slice: Option<Duration>,
    /// Where the list of recent files is kept; `None`: nowhere.
    pub recent: Option<PathBuf>,
    /// Where it is kept how panels lie, and the theme; `None`: nowhere.
    pub layout: Option<PathBuf>,
    /// Where it is kept what is open and saved nowhere, for the case that the program breaks off;
    /// `None`: nowhere.
    pub session: Option<PathBuf>,
    /// Where the lines of the log are kept; `None`: nowhere.
    pub log: Option<PathBuf>,
    /// Where views are kept by name; `None`: nowhere, they last as long as the window.
    pub views: Option<PathBuf>,
    /// Whether the system's file dialogs may be opened.
    pub dialogs: bool,
    /// What the window speaks until its user chooses.
    pub language: Language,
    /// Where folders of new structures are proposed; `None`: where the program runs.
    pub documents: Option<PathBuf>,
    /// The program that prints reports as PDF; `None`: the window offers none.
    pub pdf_printer: Option<PathBuf>,
}

impl PanelsPlugin {
    /// As on a desktop: 8 ms a frame and what the last step takes beyond, recent files in the
    /// user's data folder, the system's language.
    #[must_use]
    pub fn desktop() -> Self {
        let file = |name| dirs::data_dir().map(|d| d.join("intrados").join(name));
        let [recent, layout] = ["recent.json", "layout.json"].map(file);
        let [session, views, log] = ["session.json", "views.json", "log.txt"].map(file);
        let language = sys_locale::get_locale().map_or(Language::English, |tag| Language::of(&tag));
        let slice = Some(Duration::from_millis(8));
        let documents = dirs::document_dir().or_else(dirs::home_dir);
        let (dialogs, pdf_printer) = (true, pdf::printer());
        Self {
            slice,
            recent,
            layout,
            session,
            log,
            views,
            dialogs,
            language,
            documents,
            pdf_printer,
        }
    }
}

impl Plugin for PanelsPlugin {
    fn build(&self, app: &mut App) {
        let desk = workspace::Desk::read(self.layout.clone());
        let (colours, ranges) = desk.scales();
        let session = session::Session::read(self.session.clone());
        // A second window leaves both to the first.
        let log = self.log.clone().filter(|_| session.is_kept());
        app.init_resource::<Panels>()
            .init_resource::<Actions>()
            .init_resource::<Selection>()
            .insert_resource(workspace::SystemLanguage(self.language))
            .insert_resource(Look { colours, ..Look::default() })
            .insert_resource(ranges)
            .init_resource::<Viewpoint>()
            .init_resource::<Statistics>()
            .init_resource::<Latest>()
            .init_resource::<history::History>()
            .init_resource::<moment::Moment>()
            .init_resource::<moment::Courses>()
            .init_resource::<play::Play>()
            .insert_resource(Log::kept(log))
            .init_resource::<picture::Picture>()
            .init_resource::<picture::Cursor>()
            .init_resource::<smooth::Smoothed>()
            .init_resource::<reference::Reference>()
            .init_resource::<light_line::LightLine>()
            .init_resource::<border::Border>()
            .init_resource::<outline::Outline>()
            .init_resource::<fields::Fields>()
            .init_resource::<directions::Directions>()
            .init_resource::<Banners>()
            .insert_resource(dialog::Dialogs::new(self.dialogs))
            .init_resource::<export::Export>()
            .init_resource::<ct::Ct>()
            .init_resource::<photos::Photos>()
            .init_resource::<stress::Stress>()
            .init_resource::<report::Report>()
            .init_resource::<layout::Layout>()
            .init_resource::<command::Palette>()
            .init_resource::<sheet::Listing>()
            .init_resource::<sheet::Properties>()
            .init_resource::<attach::Form>()
            .init_resource::<drops::Drops>()
            .init_resource::<edits::Edits>()
            .init_resource::<create::Creation>()
            .init_resource::<toast::Toasts>()
            .init_resource::<trail::Trail>()
            .init_resource::<saving::Saving>()
            .init_resource::<structure::Structure>()
            .insert_resource(desk)
            .insert_resource(MachineSetup {
                documents: self.documents.clone(),
                pdf_printer: self.pdf_printer.clone(),
            })
            .insert_resource(intrados_light::plugin::Widening(stress::WIDENING))
            .insert_resource(Refine::new(self.slice))
            .insert_resource(session)
            .insert_resource(recent::Recent::read(self.recent.clone()))
            .insert_resource(views::Views::read(self.views.clone()))
            .add_systems(
                Update,
                (action::act, dialog::take, viewpoint::steer, refine::share_frame)
                    .chain()
                    .in_set(Stage::Load),
            )
            .add_systems(
                Update,
                (layout::greet, viewpoint::adopt, border::leave).chain().in_set(Stage::Estimate),
            )
            .add_systems(
                Update,
                (
                    prediction::gather,
                    (history::keep, moment::follow),
                    refine::keep_time,
                    (picture::develop, smooth::smooth),
                    reference::compare,
                    fields::paint,
                    statistics::observe,
                    outline::trace,
                    export::take,
                    stress::take,
                    report::take,
                    edits::take,
                    create::take,
                    saving::take,
                    session::keep,
                    banner::gather,
                    log::keep,
                )
                    .chain()
                    .in_set(Stage::Present),
            );
        app.add_panel(Place::Left, "Members", members::members)
            .add_panel(Place::Right, "Member", sheet::member)
            .add_panel(Place::Right, "Inspector", inspector::inspector)
            .add_panel(Place::Right, "Meters", meters::meters)
            .add_panel(Place::Right, "Directions", directions::directions)
            .add_panel(Place::Bottom, "Convergence", convergence::convergence)
            .add_panel(Place::Bottom, "Steering", steering::steering)
            .add_panel(Place::Bottom, "Jobs", log::jobs)
            .add_panel(Place::Bottom, "Log", log::log)
            .add_panel(Place::Tab, "Structure", structure::structure)
            .add_panel(Place::Tab, "Render", render::render)
            .add_panel(Place::Tab, "Photos", photos::photos)
            .add_panel(Place::Tab, "CT", ct::ct)
            .add_panel(Place::Tab, "Stress", stress::stress)
            .add_panel(Place::Tab, "Report", report::report);
    }
}
