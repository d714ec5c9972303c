//! The report for people.

use intrados_stage::Estimate;
use std::fmt::Write;

use intrados_ct::score::Figure;
use intrados_ct::{
    detect::Settings,
    picture::{CRACK, MISSED, PORE, Picture},
    synthetic::drawn::MARK,
};
use intrados_damage::{
    forecast::FORECAST,
    ledger::Group,
    predict::{MemberPrediction, Origin, Prediction, SliceReading},
    score::MemberScore,
    verdict::{Basis, NAMED},
};

use super::{
    Document, Provenance,
    svg::{gauge, histogram, profile},
    visibility::{
        SEEN_FROM,
        photograph::{PhotographedDefect, Sensor},
        radiograph::{RadiographedDefect, SLICES, VIEWS},
    },
};

/// The whole report as one self-contained HTML document. `pictures`: the rendered members, shown after the summary.
#[must_use]
pub fn html(document: &Document, pictures: &[Picture], provenance: &Provenance) -> String {
    let prediction = &document.prediction;
    let title = format!("Damage prediction: {}", escape(&prediction.scene));
    let parts = [
        head(prediction, provenance),
        summary(prediction),
        members(prediction),
        rendered(pictures),
        prediction.members.iter().filter(|m| m.damage.is_some()).map(|m| sheet(prediction, m)).collect(),
        silent(prediction),
        ledger(prediction),
        photograph(&document.photograph),
        radiograph(&document.radiograph),
        score(&prediction.score, is_drawn(prediction)),
        grading(prediction),
        limits(prediction),
        origin(prediction, provenance),
        "<div class=\"sign\"><div>Prepared by, date</div><div>Checked by (qualified engineer), date</div><div>Decision and measure</div></div>\
         <footer>Decision support: to be reviewed by a qualified engineer. Not a substitute for inspection or assessment to a standard.</footer>"
            .to_owned(),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>{title}</title><style>\n{}</style></head><body><main>\n{}\n</main></body></html>\n",
        include_str!("report.css"),
        parts.join("\n")
    )
}

fn head(p: &Prediction, provenance: &Provenance) -> String {
    let short: String = p.scene_hash.chars().take(12).collect();
    let note = if is_drawn(p) {
        format!(
            "<p class=\"note\"><b>Some slices in this report are {MARK}.</b> They are pictures made by a program from planted damage; no specimen was scanned.</p>"
        )
    } else {
        String::new()
    };
    format!(
        "<header><div><h1>Damage prediction</h1><p>Scene <b>{}</b></p></div><div class=\"id\">{}<br>Intrados {}<br>scene <span class=\"mono\">{}</span></div></header>{note}",
        escape(&p.scene),
        escape(&provenance.date),
        p.version,
        escape(&short)
    )
}

fn summary(p: &Prediction) -> String {
    let known: Vec<&MemberPrediction> = p.members.iter().filter(|m| m.damage.is_some()).collect();
    let worst = known.iter().max_by(|a, b| a.damage.unwrap_or(0.0).total_cmp(&b.damage.unwrap_or(0.0)));
    let mut html = "<h2>Summary</h2>".to_owned();
    if let Some(w) = worst {
        let _ = write!(
            html,
            "<p>Worst member: <b>{}</b>, damage {}, {}. {}</p>",
            escape(&w.name),
            plus_minus(w.damage, w.damage_std_error),
            member_chip(w),
            escape(&w.advice)
        );
    }
    html += "<div class=\"cards\">";
    let mut card = |n: usize, label: &str| {
        let _ = write!(html, "<div class=\"card\"><b>{n}</b><span>{label}</span></div>");
    };
    for state in p.profile.states.iter().rev() {
        card(p.members.iter().filter(|m| m.state == state.name).count(), &format!("{}, measured", escape(&state.name)));
    }
    let undecided = |m: &&MemberPrediction| m.basis == Basis::Measured && m.state_run.is_some_and(|[best, worst]| best < worst);
    card(p.members.iter().filter(undecided).count(), "measured, state left open by the error bar");
    card(p.members.iter().filter(|m| m.basis == Basis::Foretold).count(), "foretold only, nothing measured");
    card(p.members.len() - known.len(), "without evidence (not the same as sound)");
    card(p.members.iter().filter(|m| m.conflict).count(), "with contradicting evidence");
    card(p.items.iter().filter(|i| !i.used).count(), "items of evidence not used");
    html + "</div>"
}

fn members(p: &Prediction) -> String {
    let limits: Vec<f64> = p.profile.states.iter().map(|s| s.from).collect();
    let any_truth = p.members.iter().any(|m| m.truth.is_some());
    let mut html = format!(
        "<h2>Members</h2><table><tr><th>Member</th><th>Kind</th><th>State</th><th>Damage d, 95 % interval</th><th class=\"n\">d ± standard error</th>{}<th>Evidence</th></tr>",
        if any_truth { "<th class=\"n\">True d</th>" } else { "" }
    );
    for m in &p.members {
        let truth = m.truth.as_ref().map(|t| t.damage);
        let gauge = m.damage.zip(m.damage_std_error).map(|(d, s)| gauge(d, s, m.basis, truth, &limits)).unwrap_or_default();
        let evidence: Vec<String> =
            m.evidence.iter().map(|(source, e)| format!("{source} {}", plus_minus(Some(e.damage), Some(e.std_error)))).collect();
        let true_cell = truth.map_or("–".to_owned(), |t| format!("{t:.2}"));
        let _ = write!(
            html,
            "<tr><td><b>{}</b></td><td>{}</td><td>{}</td><td>{gauge}</td><td class=\"n\">{}</td>{}<td class=\"small\">{}{}</td></tr>",
            escape(&m.name),
            kind(m),
            member_chip(m),
            plus_minus(m.damage, m.damage_std_error),
            if any_truth { format!("<td class=\"n\">{true_cell}</td>") } else { String::new() },
            if evidence.is_empty() { "none".to_owned() } else { evidence.join("<br>") },
            if m.conflict { "<br><b>The evidence contradicts itself, see below.</b>" } else { "" }
        );
    }
    let _ = write!(
        html,
        "</table><p class=\"small\">Damage d: share of strength lost in the worst zone, a tenth of the length, 0 sound to 1 lost. Ticks: limits of the states. A state is named when its probability is {NAMED} or more; else the states between which it lies. Dashed and hollow: foretold, nothing was measured.",
    );
    html += if any_truth { " Triangle: truth.</p>" } else { "</p>" };
    html
}

fn rendered(pictures: &[Picture]) -> String {
    let mut html = String::new();
    for (picture, url) in pictures.iter().filter_map(|p| Some((p, p.data_url()?))) {
        let caption = escape(&picture.caption);
        let _ = write!(html, "<figure><img src=\"{url}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>");
    }
    if html.is_empty() { html } else { format!("<h2>Rendered members</h2>{html}") }
}

fn sheet(p: &Prediction, m: &MemberPrediction) -> String {
    let mut html = format!("<section class=\"sheet\"><h2><span>{}</span>{}</h2>", escape(&m.name), member_chip(m));
    let concrete = format!("{}{}", escape(&m.concrete), if m.concrete_assumed { " (assumed)" } else { "" });
    let _ = write!(html, "<p class=\"small\">{}, {concrete}, id <span class=\"mono\">{}</span></p>", kind(m), escape(&m.id));
    let _ = write!(html, "<p>Damage {}. {}</p>", plus_minus(m.damage, m.damage_std_error), escape(&m.advice));
    html += &likely(p, m);
    html += &truth(m);
    html += &zones(m);
    html += &evidence(p, m);
    for slice in by_damage(&m.slices) {
        html += &figure(slice);
    }
    if m.slices.is_empty() {
        return html + "</section>";
    }
    html += &slices(m);
    let diameters: Vec<f64> = m.slices.iter().flat_map(|s| s.table.iter().map(|p| p.diameter_mm)).collect();
    html += "<div class=\"split\">";
    if !diameters.is_empty() {
        let _ =
            write!(html, "<div><h3>Pore sizes, {} pores in {} slices</h3>{}</div>", diameters.len(), m.slices.len(), histogram(&diameters));
    }
    html += &largest(m);
    html + "</div></section>"
}

/// How likely each state is, and what is assumed of rust.
fn likely(p: &Prediction, m: &MemberPrediction) -> String {
    let states =
        p.profile.states.iter().filter_map(|s| Some(format!("{} {:.0} %", escape(&s.name), 100.0 * m.state_probability.get(&s.name)?)));
    let mut html = format!("<p class=\"small\">Probability of each state: {}.</p>", states.collect::<Vec<_>>().join(", "));
    let Some(rust) = m.evidence.get(FORECAST).and_then(|e| e.details.get("rust")) else { return html };
    if let Some(why) = rust["why_not"].as_str() {
        let _ = write!(html, "<p><b>Rust of bars: not computed</b> ({}).</p>", escape(why));
    }
    let assumed: Vec<String> = rust["assumed"].as_array().into_iter().flatten().filter_map(|a| a.as_str().map(escape)).collect();
    if !assumed.is_empty() {
        let begins =
            rust["depassivation_years"].as_f64().map_or("not within a thousand years".into(), |years| format!("after {years:.0} years"));
        let _ = write!(
            html,
            "<p class=\"small\"><b>Assumed, not measured</b>: {}. By the means of this steel under the least cover ({:.0} mm) begins to rust {begins}; probability that it has begun: {:.0} %.</p>",
            assumed.join("; "),
            rust["cover_mm"].as_f64().unwrap_or(0.0),
            100.0 * rust["probability_depassivated"].as_f64().unwrap_or(0.0)
        );
    }
    html
}

fn truth(m: &MemberPrediction) -> String {
    let Some(t) = &m.truth else { return String::new() };
    let mut html = format!("<p>Truth ({}): d = {:.3}, {}", t.origin, t.damage, escape(&t.state));
    if let Some(porosity) = t.porosity {
        let _ = write!(html, ", mean porosity of the sections {:.2} %", 100.0 * porosity);
    }
    if !t.not_visible.is_empty() {
        let _ = write!(html, ". No slice shows: {}", escape(&t.not_visible.join("; ")));
    }
    html + ".</p>"
}

/// Damage along the axis, and how much of the length is in which state.
fn zones(m: &MemberPrediction) -> String {
    if m.damage.is_none() {
        return String::new();
    }
    let split: Vec<String> = m.states.iter().map(|(state, share)| format!("{:.0} % {}", 100.0 * share, escape(state))).collect();
    let mut html = format!("<div class=\"split\"><div><h3>Damage along the axis</h3>{}</div>", profile(m));
    let _ = write!(html, "<div><h3>Of its length, as is to be expected</h3><p>{}</p>", split.join("<br>"));
    if let Some(c) = &m.crack_check {
        let verdict = if c.exceeded { "<b>wider than</b>" } else { "within" };
        let _ = write!(
            html,
            "<h3>Crack width</h3><p>{:.2} mm ({}), {verdict} the {} mm of exposure {}</p>",
            c.width_mm,
            escape(c.source),
            c.limit_mm,
            escape(&c.exposure)
        );
    }
    html + "</div></div>"
}

/// What each physics says.
fn evidence(p: &Prediction, m: &MemberPrediction) -> String {
    if m.evidence.is_empty() {
        return String::new();
    }
    let mut html = "<h3>Evidence</h3><table class=\"dense\"><tr><th>Source</th><th>Cause</th><th class=\"n\">Damage of its worst zone</th><th class=\"n\">blind to ±</th><th>Rests on</th></tr>".to_owned();
    for (source, e) in &m.evidence {
        for (k, (cause, zones)) in e.zones.iter().enumerate() {
            let worst = zones.worst().map(|(_, r)| r);
            let _ = write!(
                html,
                "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{:.2}</td><td class=\"small\">{}</td></tr>",
                if k == 0 { escape(source) } else { String::new() },
                cause.name(),
                plus_minus(worst.map(|r| r.value), worst.map(|r| r.std_error)),
                p.profile.fusion.blind(source, *cause),
                if k == 0 { escape(&e.basis) } else { String::new() }
            );
        }
    }
    html += "</table>";
    if m.conflict {
        let lines: String = m.conflicts.iter().map(|c| format!("<li>{}</li>", escape(c))).collect();
        let _ = write!(
            html,
            "<p><b>The evidence contradicts itself</b> (χ² beyond what chance gives once in a hundred). It was not averaged: what is measured goes before what is foretold, and of what is measured the largest damage counts.</p><ul>{lines}</ul>"
        );
    }
    html
}

/// The members that nothing is known of.
fn silent(p: &Prediction) -> String {
    let names: Vec<String> = p.members.iter().filter(|m| m.damage.is_none()).map(|m| escape(&m.name)).collect();
    match names.is_empty() {
        true => String::new(),
        false => format!(
            "<section class=\"sheet\"><h2>No evidence</h2><p>Of these members nothing is known, neither slices nor readings nor loads on what holds them, which is not the same as sound: {}.</p></section>",
            names.join(", ")
        ),
    }
}

/// What a photograph would show of each known defect.
fn photograph(defects: &[PhotographedDefect]) -> String {
    if defects.is_empty() {
        return String::new();
    }
    let mut html = "<section><h2>What a photograph would show</h2><table class=\"dense\"><tr><th>Member</th><th>Defect</th><th>Camera</th><th class=\"n\">Distance [m]</th><th class=\"n\">Pixel [mm]</th>\
         <th class=\"n\">Contrast</th><th class=\"n\">Contrast to noise</th><th>Seen</th></tr>"
        .to_owned();
    for s in defects {
        let seen = match (s.in_view, s.seen) {
            (false, _) => "not in view",
            (true, true) => "yes",
            (true, false) => "no",
        };
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.2}</td><td class=\"n\">{}</td><td>{seen}</td></tr>",
            escape(&s.member),
            escape(&s.defect),
            escape(&s.camera),
            s.distance_m,
            s.pixel_mm,
            s.contrast,
            if s.in_view { format!("{:.1} ± {:.1}", s.contrast_to_noise, s.std_error) } else { "–".into() }
        );
    }
    let Sensor { full, read, mottling } = Sensor::default();
    html + &format!(
        "</table><p class=\"small\">At the camera's exposure: shot noise of {full:.0} electrons at white, read noise of {read}, mottling of concrete {:.0} % a pixel. What each defect does to each pixel comes from one run of walks (sensitivities). Seen: contrast to noise of all its pixels together at least {SEEN_FROM} (Rose 1948). Not covered: the shape of a spall (shadows) and other colours.</p></section>",
        100.0 * mottling
    )
}

/// What the scene's scanners would show of each known defect inside.
fn radiograph(defects: &[RadiographedDefect]) -> String {
    if defects.is_empty() {
        return String::new();
    }
    let mut html = "<section><h2>What a projection would show</h2><table class=\"dense\"><tr><th>Member</th><th>Defect</th><th>Scanner</th><th class=\"n\">Along</th><th class=\"n\">Best view [°]</th>\
         <th class=\"n\">Contrast</th><th class=\"n\">Contrast to noise</th><th class=\"n\">Whole scan</th><th>Seen at once</th></tr>"
        .to_owned();
    for s in defects {
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.2}</td><td class=\"n\">{:.0}</td><td class=\"n\">{:.3}</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.0}</td><td>{}</td></tr>",
            escape(&s.member),
            escape(&s.defect),
            escape(&s.scanner),
            s.along,
            s.view_deg,
            s.contrast,
            s.contrast_to_noise,
            s.whole_scan,
            if s.seen { "yes" } else { "no" }
        );
    }
    html + &format!(
        "</table><p class=\"small\">At the scanner's dose, its beam cut to {SLICES} slices: photons counted, scattered ones included, and electronic noise; the best of {VIEWS} views, and all of the scan's together. Cracks as shares of the bands that they wander in, concrete without grain. Seen: at least {SEEN_FROM}.</p></section>"
    )
}

/// Every item of evidence, and what became of it.
fn ledger(p: &Prediction) -> String {
    if p.items.is_empty() {
        return String::new();
    }
    let mut html =
        "<section><h2>Evidence, item by item</h2><table class=\"dense\"><tr><th>Member</th><th>Source</th><th>Item</th><th>Used</th></tr>"
            .to_owned();
    for group in Group::all(&p.items) {
        let first = group.first();
        let verdict = if first.used { escape(&first.verdict()) } else { format!("<b>{}</b>", escape(&first.verdict())) };
        let [member, source, name] = [&first.member, first.source, &group.name()].map(escape);
        let _ =
            write!(html, "<tr><td>{member}</td><td>{source}</td><td class=\"small\">{name}</td><td class=\"small\">{verdict}</td></tr>");
    }
    html + "</table></section>"
}

/// The slices whose pictures were kept, worst first.
fn by_damage(slices: &[SliceReading]) -> Vec<&SliceReading> {
    let mut kept: Vec<&SliceReading> = slices.iter().filter(|s| s.pictures.is_some()).collect();
    kept.sort_by(|a, b| b.whole().value.total_cmp(&a.whole().value));
    kept
}

fn figure(slice: &SliceReading) -> String {
    let Some([plain, overlay]) = slice.pictures.as_ref().map(|p| p.each_ref().map(Picture::data_url)) else { return String::new() };
    let (plain, overlay) = (plain.unwrap_or_default(), overlay.unwrap_or_default());
    let key = |[r, g, b]: [u8; 3], word: &str| format!("<span class=\"key\" style=\"border-color:rgb({r},{g},{b})\"></span>{word}");
    let missed = if slice.truth.is_some() { key(MISSED, "missed") } else { String::new() };
    let mark = if slice.origin == Origin::Drawn { format!(", <b>{MARK}</b>") } else { String::new() };
    let name = escape(slice.name.trim_end_matches(&format!(" ({MARK})")));
    format!(
        "<div class=\"pair\"><figure><img src=\"{plain}\" alt=\"slice\"><figcaption>{}: {name}{mark}. Pixel {} mm. White: steel or air.</figcaption></figure>\
         <figure><img src=\"{overlay}\" alt=\"slice with outlines\"><figcaption>What was read: {}{}{missed}. <br>Porosity ({:.2} ± {:.2}) %, section damage {}.</figcaption></figure></div>",
        escape(&slice.core),
        slice.pixel_mm,
        key(PORE, "pore"),
        key(CRACK, "crack"),
        100.0 * slice.porosity.value,
        100.0 * slice.porosity.std_error,
        plus_minus(Some(slice.whole().value), Some(slice.whole().std_error)),
    )
}

fn slices(m: &MemberPrediction) -> String {
    const MOST: usize = 24;
    let truth = m.slices.iter().any(|s| s.truth.is_some());
    let truth_head = if truth {
        "<th class=\"n\">True porosity [%]</th><th class=\"n\">True d</th><th class=\"n\">Dice</th><th class=\"n\">F1</th>"
    } else {
        ""
    };
    let mut html = format!(
        "<h3>Sections</h3><table class=\"dense\"><tr><th>Core</th><th>Slice</th><th class=\"n\">Pores</th><th class=\"n\">Porosity [%]</th><th class=\"n\">Cracks</th><th class=\"n\">Length [mm]</th>\
         <th class=\"n\">Widest [mm]</th><th class=\"n\">d, pores and cracks</th><th class=\"n\">Fallen off [%]</th><th class=\"n\">Steel [mm²]</th><th class=\"n\">of</th>\
         <th class=\"n\">Steel lost [%]</th>{truth_head}</tr>"
    );
    let worst = m.slices.iter().map(|s| s.whole().value).fold(0.0, f64::max);
    let percent = |r: Option<Estimate>| r.map_or("–".to_owned(), |r| format!("{:.1} ± {:.1}", 100.0 * r.value, 100.0 * r.std_error));
    let area = |mm2: Option<f64>| mm2.map_or("–".to_owned(), |mm2| format!("{mm2:.0}"));
    for s in m.slices.iter().take(MOST) {
        let width = s.cracks.iter().map(|c| c.width_mm).reduce(f64::max);
        let _ = write!(
            html,
            "<tr{}><td class=\"fix\">{}</td><td class=\"name\">{}</td><td class=\"n\">{}</td><td class=\"n\">{:.2} ± {:.2}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>",
            if s.whole().value == worst && worst > 0.0 { " class=\"here\"" } else { "" },
            escape(&s.core),
            escape(&s.name),
            s.pores,
            100.0 * s.porosity.value,
            100.0 * s.porosity.std_error,
            s.cracks.len(),
            if s.cracks.is_empty() { "–".to_owned() } else { format!("{:.0}", s.cracks.iter().map(|c| c.length_mm).sum::<f64>()) },
            width.map_or("–".to_owned(), |w| format!("{w:.2}")),
            plus_minus(Some(s.damage.value), Some(s.damage.std_error)),
            percent(s.lost),
            area(s.steel.map(|s| s.area_mm2)),
            area(s.steel.map(|s| s.laid_mm2)),
            percent(s.steel.map(|s| s.loss)),
        );
        if truth {
            let t = s.truth.as_ref();
            let cell = |v: Option<f64>, digits: usize| v.map_or("–".to_owned(), |v| format!("{v:.digits$}"));
            let cells = [
                cell(t.map(|t| 100.0 * t.porosity), 2),
                cell(t.map(|t| t.damage), 3),
                cell(t.and_then(|t| t.score.dice), 3),
                cell(t.and_then(|t| t.score.f1), 3),
            ];
            cells.iter().for_each(|c| html += &format!("<td class=\"n\">{c}</td>"));
        }
        html += "</tr>";
    }
    html += "</table>";
    if m.slices.len() > MOST {
        let _ = write!(html, "<p class=\"small\">{} more in slices.csv.</p>", m.slices.len() - MOST);
    }
    html
}

fn largest(m: &MemberPrediction) -> String {
    let mut pores: Vec<_> = m.slices.iter().flat_map(|s| s.table.iter().map(move |p| (s, p))).collect();
    pores.sort_by(|a, b| b.1.area_mm2.total_cmp(&a.1.area_mm2));
    if pores.is_empty() {
        return String::new();
    }
    let mut html = "<div><h3>Largest pores</h3><table class=\"dense\"><tr><th>Slice</th><th class=\"n\">Diameter [mm]</th><th class=\"n\">Area [mm²]</th><th class=\"n\">Circularity</th><th class=\"n\">Depth [mm]</th></tr>".to_owned();
    for (s, p) in pores.iter().take(5) {
        let name = s.name.trim_end_matches(&format!(" ({MARK})"));
        let _ = write!(
            html,
            "<tr><td class=\"name\">{}</td><td class=\"n\">{:.2}</td><td class=\"n\">{:.1}</td><td class=\"n\">{:.2}</td><td class=\"n\">{:.1}</td></tr>",
            escape(name),
            p.diameter_mm,
            p.area_mm2,
            p.circularity,
            p.depth_mm
        );
    }
    html + "</table><p class=\"small\">All of them in pores.csv.</p></div>"
}

/// Whether any slice was drawn and not scanned.
fn is_drawn(p: &Prediction) -> bool {
    p.members.iter().flat_map(|m| &m.slices).any(|s| s.origin == Origin::Drawn)
}

fn score(score: &MemberScore, drawn: bool) -> String {
    let mut html = "<section><h2>Score against the truth</h2>".to_owned();
    if score.members == 0 {
        return html
            + "<p>No member has both evidence and a known truth: nothing is claimed about the quality of this prediction.</p></section>";
    }
    let share = |f: Option<Figure>| figure_cells(f, 100.0, " %", 0);
    let _ = write!(
        html,
        "<p>{} members with evidence and known truth, {} of them truly severe (d ≥ {}). One is taken as called severe when that is more likely than not, named or not; of {} neither is {:.0} % sure. Truth and prediction use the same rule; the truth contains what slices cannot show.</p>",
        score.members,
        score.severe,
        score.severe_from,
        score.undecided,
        100.0 * NAMED
    );
    if drawn {
        let _ = write!(
            html,
            "<p>Where slices are {MARK}, this is self-consistency and not accuracy: the program that reads them also drew them.</p>"
        );
    }
    html += "<table><tr><th>Figure</th><th class=\"n\">Value</th><th class=\"n\">95 % interval</th><th class=\"n\">n</th></tr>";
    let rows = [
        ("Severe members found (recall)", share(score.recall)),
        ("Members called severe that are (precision)", share(score.precision)),
        ("F1, severe members", figure_cells(score.f1, 1.0, "", 2)),
        ("Mean absolute error of d", figure_cells(score.mean_absolute_error, 1.0, "", 3)),
        ("95 % intervals of d that hold the truth", share(score.coverage_95)),
        ("Damaged zones: IoU with the true ones", figure_cells(score.zone_iou, 1.0, "", 2)),
        ("95 % intervals of zones that hold the truth", share(score.zone_coverage_95)),
        ("Relative error of a slice's porosity", share(score.porosity_error)),
        ("Error of a slice's widest crack", figure_cells(score.crack_width_error_mm, 1.0, " mm", 3)),
        ("95 % intervals of a slice's porosity that hold the truth", share(score.slice_coverage_95)),
    ];
    rows.iter().for_each(|(label, cells)| html += &format!("<tr><td>{label}</td>{cells}</tr>"));
    let plain = |v: Option<f64>, digits: usize| v.map_or("–".to_owned(), |v| format!("{v:.digits$}"));
    let s = &score.slices;
    let single = [
        ("Skill: error saved over calling every member sound", plain(score.skill_over_all_sound, 2)),
        ("Pixels: Dice", plain(s.dice, 3)),
        ("Pores and cracks: F1 (precision, recall)", format!("{} ({}, {})", plain(s.f1, 3), plain(s.precision, 3), plain(s.recall, 3))),
        ("Pores and cracks: panoptic quality", plain(s.panoptic_quality, 3)),
        ("Mean relative error of the dark area of a slice", s.porosity_error.map_or("–".to_owned(), |v| format!("{:.1} %", 100.0 * v))),
    ];
    single.iter().for_each(|(label, value)| html += &format!("<tr><td>{label}</td><td class=\"n\">{value}</td><td></td><td></td></tr>"));
    html + "</table><p class=\"small\">Shares of members and slices: Wilson's interval; all else: bootstrap over members or slices.</p></section>"
}

fn figure_cells(figure: Option<Figure>, scale: f64, unit: &str, digits: usize) -> String {
    match figure {
        Some(f) => format!(
            "<td class=\"n\">{:.digits$}{unit}</td><td class=\"n\">{:.digits$} to {:.digits$}{unit}</td><td class=\"n\">{}</td>",
            scale * f.value,
            scale * f.ci95[0],
            scale * f.ci95[1],
            f.n
        ),
        None => "<td class=\"n\">–</td><td></td><td class=\"n\">0</td>".to_owned(),
    }
}

fn grading(p: &Prediction) -> String {
    let (profile, rule) = (&p.profile, p.profile.rule);
    let checked = if profile.checked_by.is_empty() { "nobody yet".to_owned() } else { escape(&profile.checked_by) };
    let mut html = format!(
        "<section><h2>How sections become damage and states</h2><p>Profile <b>{}</b>, edition {}; checked by: <b>{checked}</b>.</p><p class=\"small\">{}</p>\
         <p>Section damage d = 1 − (1 − d<sub>pores</sub>)(1 − d<sub>cracks</sub>). Pores: 1 − exp(−{} (porosity − {})), none below that porosity. \
         Cracks: sum of length over the section's side, weighted by width up to {} mm. A member has the damage of its worst zone. In each zone, and for each cause of damage, the evidence is fused by inverse variance, with the correlations and the blindness of each source that the profile declares; causes are taken together, 1 − Π(1 − d), and one that nothing speaks of counts as nothing with the error that the profile declares for it; \
         what is foretold is the prior of what is measured and yields to it where they differ by more than chance gives once in twenty. What lies between slices is not seen: it widens a zone after that, and is in the error of \"ct\" too.</p>\
         <table><tr><th>State</th><th class=\"n\">from d</th><th class=\"n\">or crack width [mm]</th><th>Advice</th></tr>",
        escape(&profile.name),
        escape(&profile.edition),
        escape(&profile.source),
        rule.strength_loss,
        rule.sound_porosity,
        rule.open_crack_mm
    );
    for s in &profile.states {
        let width = s.crack_width_mm.map_or("–".to_owned(), |w| w.to_string());
        let _ = write!(
            html,
            "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{width}</td><td>{}</td></tr>",
            chip(p, &s.name),
            s.from,
            escape(&s.advice)
        );
    }
    html + "</table></section>"
}

fn limits(p: &Prediction) -> String {
    let items: String = p.limits.iter().map(|l| format!("<li>{}</li>", escape(l))).collect();
    format!("<section><h2>Limits</h2><ul>{items}</ul></section>")
}

fn origin(p: &Prediction, provenance: &Provenance) -> String {
    let number = |v: Option<u64>| v.map_or("–".to_owned(), |v| v.to_string());
    let rows = [
        ("Program", format!("Intrados {}", p.version)),
        ("Scene", escape(&p.scene)),
        ("Hash of the scene and its files", escape(&p.scene_hash)),
        ("Command", escape(&provenance.command)),
        ("Seed of the pictures", number(provenance.seed)),
        ("Samples a pixel of the pictures", number(provenance.samples)),
        ("Slices read by", escape(&detection(p))),
    ];
    let rows: String = rows.iter().map(|(label, value)| format!("<tr><td>{label}</td><td class=\"mono\">{value}</td></tr>")).collect();
    format!("<section><h2>Provenance</h2><table>{rows}</table></section>")
}

/// By what each kind of slice was read; what is not there was not read.
fn detection(p: &Prediction) -> String {
    let slices = || p.members.iter().flat_map(|m| &m.slices);
    let how = |s: &SliceReading| if s.origin == Origin::Scanned { Settings::of_members() } else { p.settings }.says(s.pixel_mm);
    let all: std::collections::BTreeSet<String> = slices().map(how).collect();
    if all.is_empty() { "no slices were read".into() } else { all.into_iter().collect::<Vec<_>>().join(" / ") }
}

/// A member's state: as bad as it may be, dashed where it is only foretold.
fn member_chip(m: &MemberPrediction) -> String {
    let Some([_, worst]) = m.state_run else { return format!("<span class=\"state sx\">– {}</span>", escape(&m.state)) };
    let last = m.state_probability.len().saturating_sub(1).max(1);
    let level = (3 * worst).div_ceil(last).min(3);
    let (sign, look) = if m.basis == Basis::Foretold { ("◌", " foretold") } else { (SIGNS[level], "") };
    format!("<span class=\"state s{level}{look}\">{sign} {}</span>", escape(&m.state))
}

const SIGNS: [&str; 4] = ["○", "◔", "◑", "●"];

/// A state with a sign and a colour; the word carries the meaning.
fn chip(p: &Prediction, state: &str) -> String {
    let last = p.profile.states.len().saturating_sub(1).max(1);
    match p.profile.states.iter().position(|s| s.name == state) {
        Some(rank) => {
            let level = (3 * rank).div_ceil(last).min(3);
            format!("<span class=\"state s{level}\">{} {}</span>", SIGNS[level], escape(state))
        }
        None => format!("<span class=\"state sx\">– {}</span>", escape(state)),
    }
}

fn kind(m: &MemberPrediction) -> String {
    format!("{:?}", m.kind).to_lowercase()
}

fn plus_minus(value: Option<f64>, std_error: Option<f64>) -> String {
    match (value, std_error) {
        (Some(v), Some(s)) => format!("{v:.2} ± {s:.2}"),
        _ => "–".to_owned(),
    }
}

/// Text as HTML text or attribute.
fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            '\'' => safe += "&#39;",
            c => safe.push(c),
        }
    }
    safe
}
