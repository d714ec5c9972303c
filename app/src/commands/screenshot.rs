//! `intrados screenshot`: the window as somebody would see it, as a picture.

use crate::{
    args,
    failure::{Failure, Outcome},
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Screenshot) -> Result<Outcome, Failure> {
    if let Some(reason) = super::view::no_window() {
        return Err(Failure::Usage(format!("{reason}: try it under `xvfb-run -a`")));
    }
    take(session, args)
}

#[cfg(feature = "desktop")]
fn take(session: &Session, args: &args::Screenshot) -> Result<Outcome, Failure> {
    use std::time::Duration;

    use intrados_panels::{Action, Language, PanelsPlugin, Workspace};

    use crate::desktop::{Shot, take_shot};

    super::view::exists(&args.scene)?;
    let theme = match args.theme {
        args::WindowTheme::Light => egui::ThemePreference::Light,
        args::WindowTheme::Dark => egui::ThemePreference::Dark,
    };
    let workspace = match args.layout {
        args::WindowLayout::Inspector => Workspace::Inspector,
        args::WindowLayout::Expert => Workspace::Expert,
    };
    let shot = Shot {
        first: vec![Action::Theme(theme), Action::Open(args.scene.clone())],
        then: std::iter::once(Action::Arrange(workspace))
            .chain(args.tab.iter().map(|tab| Action::Panel(tab.clone(), true)))
            .collect(),
        member: args.member.clone(),
        size: args.size.map(|n| n as f32),
        scale: args.scale,
        wait: Duration::from_secs(args.wait),
        out: args.out.clone(),
    };
    let language = match args.language {
        args::WindowLanguage::En => Language::English,
        args::WindowLanguage::De => Language::German,
        args::WindowLanguage::Zh => Language::Chinese,
    };
    // Nothing of how the user has arranged his own window is in it, and nothing of it is changed.
    let panels = PanelsPlugin {
        recent: None,
        layout: None,
        session: None,
        log: None,
        views: None,
        language,
        ..PanelsPlugin::desktop()
    };
    take_shot(super::view::builder(session, panels), shot)
        .map_err(|e| Failure::Internal(format!("no picture: {e:#}")))?;
    Ok(Outcome::Done)
}

#[cfg(not(feature = "desktop"))]
fn take(_: &Session, _: &args::Screenshot) -> Result<Outcome, Failure> {
    Err(Failure::Usage("this program was built without its window".into()))
}
