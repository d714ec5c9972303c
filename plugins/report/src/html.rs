//! The report for people: what its templates (`templates/`) lay out and escape.

use std::collections::BTreeSet;

use askama::Template;
use intrados_ct::{
    detect::{DetectSettings, Pore},
    picture::{CRACK, MISSED, PORE, Picture},
    score::Figure,
    synthetic::drawn::MARK,
};
use intrados_damage::{
    Evidence,
    evidence::Cause,
    ledger::Group,
    verdict::{Basis, NAMED},
    zone::{Zones, place},
};
use intrados_forecast::FORECAST;
use intrados_gauges::{GAUGES, GaugeReading};
use intrados_predict::{Defect, MemberPrediction, Origin, Prediction, SliceReading};
use intrados_stage::Estimate;
use intrados_survey::{SURVEY, photographed::PHOTOGRAPHED};

use super::{
    Document, Provenance,
    basis::MemberBasis,
    svg,
    visibility::{
        SEEN_FROM,
        photograph::Sensor,
        radiograph::{SLICES, VIEWS},
    },
    words::{
        NOTHING, UNTOLD, bad_probability, due, files, finding, level, many, matters, metres,
        plus_minus, within, word, worse_half,
    },
};

const CSS: &str = include_str!("report.css");
/// Sections of a member that are in the report.
const MOST: usize = 24;
/// Pores of a member that are in the report.
const LARGEST: usize = 5;
/// Longer side of a defect's photograph, pixels.
const LOOK: u32 = 240;
/// Signs of states, from the best to the worst.
const SIGNS: [&str; 4] = ["○", "◔", "◑", "●"];

/// The whole report as one self-contained HTML document. `pictures`: the rendered members, shown
/// after the summary.
///
/// # Errors
/// Memory has no room for it.
pub fn html(
    document: &Document,
    pictures: &[Picture],
    provenance: &Provenance,
) -> Result<String, askama::Error> {
    let rendered =
        pictures.iter().filter_map(|p| Some((p.data_url()?, p.caption.as_str()))).collect();
    Page { p: &document.prediction, document, provenance, rendered, sensor: Sensor::default() }
        .render()
}

#[derive(Template)]
#[template(path = "report.html")]
struct Page<'a> {
    p: &'a Prediction,
    document: &'a Document,
    provenance: &'a Provenance,
    /// Addresses of pictures, with their captions.
    rendered: Vec<(String, &'a str)>,
    sensor: Sensor,
}

/// A state with a sign and a colour; the word carries the meaning.
#[derive(Template)]
#[template(
    source = r#"<span class="state {{ look }}">{{ sign }} {{ state }}</span>"#,
    ext = "html"
)]
struct Chip<'a> {
    look: String,
    sign: &'a str,
    state: &'a str,
}

/// What the forecast assumes of rust.
struct Rust {
    why_not: Option<String>,
    assumed: String,
    cover_mm: f64,
    begins: String,
    percent: f64,
}

/// What one source says.
struct Says<'a> {
    source: &'a str,
    /// Causes of damage, and that of the worst zone.
    causes: Vec<(&'static str, String)>,
    basis: &'a str,
}

/// A gauge's reading beside what was expected.
struct Reading {
    gauge: String,
    test: String,
    measured: String,
    expected: String,
    ratio: String,
    z: String,
}

/// A slice with what was read in it.
struct Pair<'a> {
    plain: String,
    overlay: String,
    core: &'a str,
    name: &'a str,
    drawn: bool,
    pixel_mm: f32,
    /// Colours and what they mean.
    keys: Vec<(String, &'static str)>,
    porosity: String,
    damage: String,
}

/// A row of the table of sections.
struct Section<'a> {
    core: &'a str,
    name: &'a str,
    worst: bool,
    cells: [String; 10],
    truth: [String; 4],
}

/// Members that share a line.
struct Alike<'a> {
    first: &'a MemberPrediction,
    names: Vec<&'a str>,
}

/// What became of the evidence of a member.
struct Items<'a> {
    member: &'a str,
    /// What else is said of it.
    note: String,
    /// Source, items, verdict, and whether they are used.
    rows: Vec<(&'a str, String, String, bool)>,
}

/// A row of the first page.
struct Finding<'a> {
    anchor: String,
    member: &'a str,
    finding: String,
    place: String,
    damage: String,
    probability: String,
    action: &'a str,
    when: String,
}

impl<'a> Page<'a> {
    /// What stands on the cover; what nobody has stated is left to be filled in.
    fn cover(&self) -> Vec<(&'static str, String)> {
        let project = &self.document.basis.project;
        let blank = |text: &str| {
            if text.is_empty() { "……………".to_owned() } else { text.to_owned() }
        };
        let date = project.inspected.map_or_else(|| blank(""), |d| d.to_string());
        vec![
            ("Structure", blank(&project.structure)),
            ("Place", blank(&project.place)),
            ("Owner", blank(&project.owner)),
            ("Inspected by", blank(&project.inspector)),
            ("Inspected on", date),
            ("Reported on", self.provenance.date.clone()),
            ("Purpose", blank(&project.purpose)),
            ("Members", self.p.members.len().to_string()),
        ]
    }

    fn anchor(&self, m: &MemberPrediction) -> String {
        let number = self.p.members.iter().position(|other| other.id == m.id).unwrap_or(0);
        format!("member-{number}")
    }

    fn source(&self, source: &str) -> String {
        word(source).to_owned()
    }

    fn bad_states(&self) -> String {
        worse_half(&self.p.profile).iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(" or ")
    }

    /// The worst members, and what is the matter with each; but not those that are only to be
    /// inspected.
    fn findings(&self) -> Vec<Finding<'a>> {
        let likely = |m: &MemberPrediction| bad_probability(m, &self.p.profile);
        let mut members: Vec<&MemberPrediction> =
            self.p.members.iter().filter(|m| self.has_sheet(m) && !m.to_inspect).collect();
        members.sort_by(|a, b| {
            let key = |m: &MemberPrediction| (m.damage.unwrap_or(0.0), likely(m));
            let by_damage = key(b).0.total_cmp(&key(a).0);
            let by_failure = a.failure_order().total_cmp(&b.failure_order());
            by_failure.then(by_damage).then(key(b).1.total_cmp(&key(a).1))
        });
        let one = |m: &'a MemberPrediction| Finding {
            anchor: self.anchor(m),
            member: &m.name,
            finding: finding(m),
            place: m
                .worst_zone
                .map_or_else(|| NOTHING.into(), |zone| format!("{} of its length", place(zone))),
            damage: self.damage(m),
            probability: match m.damage {
                Some(_) => format!("{:.0} %", 100.0 * likely(m)),
                None => NOTHING.into(),
            },
            action: if m.damage.is_some() || m.failure.is_some() { &m.advice } else { UNTOLD },
            when: self.due(m),
        };
        members.into_iter().map(one).collect()
    }

    /// Whether a member has a sheet of its own: something was measured or found on it, its truth is
    /// known, or damage worth a line is forecast.
    fn has_sheet(&self, m: &MemberPrediction) -> bool {
        matters(m)
    }

    /// The members that are only to be inspected, and on which something was measured.
    fn to_inspect(&self) -> Vec<&'a MemberPrediction> {
        self.p.members.iter().filter(|m| m.to_inspect && self.has_sheet(m)).collect()
    }

    /// When to inspect.
    fn inspection_due(&self) -> String {
        let one = self.p.members.iter().find(|m| m.to_inspect);
        one.map_or_else(|| NOTHING.into(), |m| self.due(m))
    }

    fn members(&self, n: usize) -> String {
        many(n, "member")
    }

    fn files(&self, text: &str) -> String {
        files(text)
    }

    /// Members without a sheet, those of one damage and state in a line.
    fn alike(&self) -> Vec<Alike<'a>> {
        self.shared(&|m| format!("{} {}", self.damage(m), m.state))
    }

    /// Members without a sheet, those with the same forecast in a line.
    fn alike_by_basis(&self) -> Vec<Alike<'a>> {
        self.shared(&|m| m.evidence.values().map(|e| e.basis.as_str()).collect())
    }

    fn shared(&self, key: &dyn Fn(&MemberPrediction) -> String) -> Vec<Alike<'a>> {
        let mut lines: Vec<(String, Alike)> = Vec::new();
        for m in self.without_sheet() {
            let own = key(m);
            match lines.iter_mut().find(|(key, _)| *key == own) {
                Some((_, line)) => line.names.push(&m.name),
                None => lines.push((own, Alike { first: m, names: vec![&m.name] })),
            }
        }
        lines.into_iter().map(|(_, line)| line).collect()
    }

    /// The members of which a forecast says little and nothing else is known: no sheet.
    fn without_sheet(&self) -> Vec<&'a MemberPrediction> {
        self.p.members.iter().filter(|m| m.damage.is_some() && !self.has_sheet(m)).collect()
    }

    fn within(&self, months: &Option<u32>) -> String {
        within(*months)
    }

    /// A month does not break at its hyphen.
    fn due(&self, m: &MemberPrediction) -> String {
        due(m, &self.document.basis).replace('-', "\u{2011}")
    }

    /// What members rest on, those that are built alike in a line.
    fn built_alike(&self) -> Vec<(String, &'a MemberBasis)> {
        let mut lines: Vec<(Vec<&str>, &MemberBasis)> = Vec::new();
        for b in &self.document.basis.members {
            let name = self.p.name_of(&b.id);
            match lines.iter_mut().find(|(_, first)| first.is_built_like(b)) {
                Some((names, _)) => names.push(name),
                None => lines.push((vec![name], b)),
            }
        }
        lines.into_iter().map(|(names, b)| (names.join(", "), b)).collect()
    }

    /// Its defects on its surface, unrolled.
    fn map(&self, m: &MemberPrediction) -> String {
        svg::map(m, self.length(m))
    }

    fn has_pictures(&self, m: &MemberPrediction) -> bool {
        m.defects.iter().any(|d| d.picture.is_some() || d.photo.is_some())
    }

    /// The address of a defect's picture.
    fn look(&self, defect: &Defect) -> Option<String> {
        match &defect.photo {
            Some(photo) => Picture::read(photo, LOOK)?.data_url(),
            None => defect.picture.as_ref()?.data_url(),
        }
    }

    fn length(&self, m: &MemberPrediction) -> f64 {
        self.document.basis.length_of(&m.id)
    }

    fn along(&self, m: &MemberPrediction, defect: &Defect) -> String {
        defect.along.map_or_else(|| NOTHING.into(), |along| metres(along, self.length(m)))
    }

    /// Whether any slice was drawn and not scanned.
    fn is_drawn(&self) -> bool {
        self.p.members.iter().flat_map(|m| &m.slices).any(|s| s.origin == Origin::Drawn)
    }

    fn any_truth(&self) -> bool {
        self.p.members.iter().any(|m| m.truth.is_some())
    }

    fn worst(&self) -> Option<&'a MemberPrediction> {
        let known = self.p.members.iter().filter(|m| m.damage.is_some());
        known.max_by(|a, b| a.damage.unwrap_or(0.0).total_cmp(&b.damage.unwrap_or(0.0)))
    }

    /// How many members are in which state, and what else a reader should look at.
    fn counts(&self) -> Vec<(usize, String)> {
        let count = |is: &dyn Fn(&MemberPrediction) -> bool| {
            self.p.members.iter().filter(|m| is(m)).count()
        };
        let open = |m: &MemberPrediction| {
            m.basis == Basis::Measured && m.state_run.is_some_and(|[best, worst]| best < worst)
        };
        let states = self.p.profile.states.iter().rev();
        let mut counts: Vec<(usize, String)> = states
            .map(|s| (count(&|m| m.state == s.name), format!("{}, measured", s.name)))
            .collect();
        counts.push((count(&open), "measured, state not settled".into()));
        counts.push((
            count(&|m| m.basis == Basis::Forecast),
            "forecast only, nothing measured".into(),
        ));
        counts.push((
            count(&|m| m.damage.is_none()),
            "without evidence (not the same as sound)".into(),
        ));
        counts.push((count(&|m| m.conflict), "with contradicting evidence".into()));
        counts.push((
            self.p.items.iter().filter(|i| !i.used).count(),
            "items of evidence not used".into(),
        ));
        counts
    }

    fn silent(&self) -> String {
        let names: Vec<&str> =
            self.p.members.iter().filter(|m| m.damage.is_none()).map(|m| m.name.as_str()).collect();
        names.join(", ")
    }

    /// What became of every item, member by member; but of members with their forecast alone.
    fn ledger(&self) -> Vec<Items<'a>> {
        let mut all: Vec<(&str, Items)> = Vec::new();
        for group in Group::all(&self.p.items) {
            let first = group.first();
            let member = self.p.name_of(&first.member);
            let life = format!("the life of {member}");
            let name = group.name();
            let name = if name == life { "life of the member".into() } else { files(&name) };
            let row = (word(first.source), name, files(&first.verdict()), first.used);
            match all.last_mut().filter(|(id, _)| *id == first.member) {
                Some((_, items)) => items.rows.push(row),
                None => all
                    .push((&first.member, Items { member, note: String::new(), rows: vec![row] })),
            }
        }
        let is_forecast_alone = |items: &Items| matches!(items.rows.as_slice(), [(source, _, _, true)] if *source == FORECAST);
        let (alone, mut rest): (Vec<Items>, Vec<Items>) =
            all.into_iter().map(|(_, items)| items).partition(is_forecast_alone);
        let names: Vec<&str> = alone.iter().map(|items| items.member).collect();
        if !names.is_empty() {
            let note = format!(" of {}, used: {}", many(names.len(), "member"), names.join(", "));
            rest.push(Items { member: "Forecast alone", note, rows: Vec::new() });
        }
        rest
    }

    /// What sources cannot show of each cause: source, cause and standard error.
    fn blindness(&self) -> Vec<(String, &'static str, String)> {
        let one = |(source, cause, error): &(String, Cause, f64)| {
            (word(source).to_owned(), cause.name(), format!("{error:.2}"))
        };
        self.p.profile.fusion.blindness.iter().map(one).collect()
    }

    /// Shares of its length that are to be expected in each state, or the probability of each where
    /// it is graded by strength, from the best.
    fn shares(&self, m: &MemberPrediction) -> Vec<String> {
        let share = |name: &str| Some(format!("{:.0} % {name}", 100.0 * m.states.get(name)?));
        self.p.profile.states.iter().filter_map(|s| share(&s.name)).collect()
    }

    fn kind(&self, m: &MemberPrediction) -> String {
        format!("{:?}", m.kind).to_lowercase()
    }

    fn damage(&self, m: &MemberPrediction) -> String {
        m.damage.zip(m.damage_std_error).map_or_else(
            || NOTHING.into(),
            |(value, std_error)| plus_minus(Estimate { value, std_error }),
        )
    }

    fn plus_minus(&self, value: &f64, std_error: &f64) -> String {
        plus_minus(Estimate { value: *value, std_error: *std_error })
    }

    fn percent(&self, share: &f64, digits: usize) -> String {
        format!("{:.digits$}", 100.0 * share)
    }

    fn true_damage(&self, m: &MemberPrediction) -> String {
        cell(m.truth.as_ref().map(|t| t.damage), 2)
    }

    fn gauge(&self, m: &MemberPrediction) -> String {
        let limits: Vec<f64> = self.p.profile.states.iter().map(|s| s.from).collect();
        let truth = m.truth.as_ref().map(|t| t.damage);
        m.damage
            .zip(m.damage_std_error)
            .map(|(d, s)| svg::gauge(d, s, m.basis, truth, &limits))
            .unwrap_or_default()
    }

    fn profile(&self, m: &MemberPrediction) -> String {
        svg::profile(m)
    }

    fn histogram(&self, diameters: &[f64]) -> String {
        svg::histogram(diameters)
    }

    /// A member's state: as bad as it may be, dashed where it is a forecast.
    fn chip(&self, m: &MemberPrediction) -> String {
        let last = m.state_probability.len();
        chip(&m.state, m.state_run.map(|[_, worst]| level(worst, last)), m.basis == Basis::Forecast)
    }

    fn state_chip(&self, state: &str) -> String {
        let states = &self.p.profile.states;
        chip(
            state,
            states.iter().position(|s| s.name == state).map(|rank| level(rank, states.len())),
            false,
        )
    }

    /// How likely each state is.
    fn likely(&self, m: &MemberPrediction) -> String {
        let of =
            |state: &str| Some(format!("{state} {:.0} %", 100.0 * m.state_probability.get(state)?));
        self.p.profile.states.iter().filter_map(|s| of(&s.name)).collect::<Vec<_>>().join(", ")
    }

    fn rust(&self, m: &MemberPrediction) -> Option<Rust> {
        let rust = m.evidence.get(FORECAST)?.details.get("rust")?;
        let number = |name: &str| rust[name].as_f64();
        let assumed: Vec<&str> =
            rust["assumed"].as_array().into_iter().flatten().filter_map(|a| a.as_str()).collect();
        Some(Rust {
            why_not: rust["why_not"].as_str().map(str::to_owned),
            assumed: assumed.join("; "),
            cover_mm: number("cover_mm").unwrap_or(0.0),
            begins: number("depassivation_years")
                .map_or("not within a thousand years".into(), |years| {
                    format!("after {years:.0} years")
                }),
            percent: 100.0 * number("probability_depassivated").unwrap_or(0.0),
        })
    }

    /// What each source says of each cause.
    fn says<'m>(&self, m: &'m MemberPrediction) -> Vec<Says<'m>> {
        let worst = |zones: &Zones| {
            zones.worst().map_or_else(|| NOTHING.into(), |(_, worst)| plus_minus(worst))
        };
        let one = |(source, e): (&&'static str, &'m Evidence)| Says {
            source: word(source),
            causes: e.zones.iter().map(|(cause, zones)| (cause.name(), worst(zones))).collect(),
            basis: &e.basis,
        };
        m.evidence.iter().map(one).collect()
    }

    /// What gauges measured, beside what a sound member would show.
    fn readings(&self, m: &MemberPrediction) -> Vec<Reading> {
        let one = |r: &GaugeReading| {
            let (scale, unit) = if r.unit == "m" { (1e3, "mm") } else { (1e6, "µε") };
            let [read, error, sound] = [r.read, r.std_error, r.sound].map(|x| scale * x);
            // Two digits of the error.
            let digits = (1.0 - error.abs().max(1e-6).log10().floor()).clamp(2.0, 6.0) as usize;
            let [read, error, sound] = [read, error, sound].map(|x| number(x, digits));
            Reading {
                gauge: r.gauge.clone(),
                test: r.test.clone(),
                measured: format!("{read} ± {error} {unit}"),
                expected: format!("{sound} {unit}"),
                // Of what a sound member hardly moves the ratio is noise.
                ratio: cell((r.sound.abs() > 2.0 * r.std_error).then(|| r.read / r.sound), 2),
                z: cell(Some(r.z), 1),
            }
        };
        m.gauges.iter().map(one).collect()
    }

    /// By date of inspection, and some years on: age, and the share of bars' section that is lost.
    fn course(&self, m: &MemberPrediction) -> Vec<(String, String, String)> {
        let one = |p: svg::Point| {
            let [value, error] = [p.lost.value, p.lost.std_error].map(|x| 100.0 * x);
            let when = p.date.unwrap_or_else(|| "forecast".into());
            (when, format!("{:.0}", p.age_years), format!("{value:.1} ± {error:.1}"))
        };
        let mut rows: Vec<_> = course(m).into_iter().map(one).collect();
        // The last point lies years ahead; one before that without a date is of today.
        if let [.., (now, ..), _] = rows.as_mut_slice()
            && now == "forecast"
        {
            "now".clone_into(now);
        }
        rows
    }

    fn course_plot(&self, m: &MemberPrediction) -> String {
        svg::course(&course(m))
    }

    /// What the last inspection has changed of the share of bars' section that is taken for lost.
    fn before_the_last(&self, m: &MemberPrediction) -> Option<String> {
        let evidence = surveyed(m)?;
        let before = evidence.details.get("rust_before_the_last_inspection")?;
        let before =
            Estimate { value: before["value"].as_f64()?, std_error: before["std_error"].as_f64()? };
        let (_, now) = evidence.zones.get(&Cause::Steel)?.worst()?;
        let [then, now] =
            [before, now].map(|e| format!("{:.1} ± {:.1} %", 100.0 * e.value, 100.0 * e.std_error));
        Some(format!(
            "From the earlier inspections alone, {then} of the bars' section would be expected to \
             be lost by now; with the last inspection it is {now}."
        ))
    }

    /// The slices whose pictures were kept, worst first.
    fn figures<'m>(&self, m: &'m MemberPrediction) -> Vec<Pair<'m>> {
        let mut kept: Vec<(&SliceReading, &[Picture; 2])> =
            m.slices.iter().filter_map(|s| Some((s, s.pictures.as_ref()?))).collect();
        kept.sort_by(|a, b| b.0.whole().value.total_cmp(&a.0.whole().value));
        kept.into_iter().map(|(slice, pictures)| pair(slice, pictures)).collect()
    }

    fn has_truth(&self, m: &MemberPrediction) -> bool {
        m.slices.iter().any(|s| s.truth.is_some())
    }

    fn sections<'m>(&self, m: &'m MemberPrediction) -> Vec<Section<'m>> {
        let worst = m.slices.iter().map(|s| s.whole().value).fold(0.0, f64::max);
        m.slices.iter().take(MOST).map(|s| section(s, worst)).collect()
    }

    fn diameters(&self, m: &MemberPrediction) -> Vec<f64> {
        m.slices.iter().flat_map(|s| s.table.iter().map(|p| p.diameter_mm)).collect()
    }

    fn largest<'m>(&self, m: &'m MemberPrediction) -> Vec<(&'m str, &'m Pore)> {
        let mut pores: Vec<_> =
            m.slices.iter().flat_map(|s| s.table.iter().map(|p| (unmarked(&s.name), p))).collect();
        pores.sort_by(|a, b| b.1.area_mm2.total_cmp(&a.1.area_mm2));
        pores.truncate(LARGEST);
        pores
    }

    /// Figures of the score: label, and value, interval and n.
    fn scores(&self) -> Vec<(&'static str, [String; 3])> {
        let score = &self.p.score;
        let s = &score.slices;
        let share = |f| figure(f, 100.0, " %", 0);
        let single = |text: String| [text, String::new(), String::new()];
        let percent =
            |v: Option<f64>| v.map_or_else(|| NOTHING.into(), |v| format!("{:.1} %", 100.0 * v));
        vec![
            ("Severe members found (recall)", share(score.recall)),
            ("Members called severe that are (precision)", share(score.precision)),
            ("F1, severe members", figure(score.f1, 1.0, "", 2)),
            ("Mean absolute error of d", figure(score.mean_absolute_error, 1.0, "", 3)),
            ("95 % intervals of d that hold the truth", share(score.coverage_95)),
            ("Damaged zones: IoU with the true ones", figure(score.zone_iou, 1.0, "", 2)),
            ("95 % intervals of zones that hold the truth", share(score.zone_coverage_95)),
            ("Relative error of a slice's porosity", share(score.porosity_error)),
            ("Error of a slice's widest crack", figure(score.crack_width_error_mm, 1.0, " mm", 3)),
            (
                "95 % intervals of a slice's porosity that hold the truth",
                share(score.slice_coverage_95),
            ),
            (
                "Skill: error saved over calling every member sound",
                single(cell(score.skill_over_all_sound, 2)),
            ),
            ("Pixels: Dice", single(cell(s.dice, 3))),
            (
                "Pores and cracks: F1 (precision, recall)",
                single(format!(
                    "{} ({}, {})",
                    cell(s.f1, 3),
                    cell(s.precision, 3),
                    cell(s.recall, 3)
                )),
            ),
            ("Pores and cracks: panoptic quality", single(cell(s.panoptic_quality, 3))),
            ("Mean relative error of the dark area of a slice", single(percent(s.porosity_error))),
        ]
    }

    fn origin(&self) -> Vec<(&'static str, String)> {
        let number = |v: Option<u64>| v.map_or_else(|| NOTHING.into(), |v| v.to_string());
        vec![
            ("Program", format!("Intrados {}", self.p.version)),
            ("Scene file", self.p.scene.clone()),
            ("Hash of that and its files", self.p.scene_hash.clone()),
            ("Command", self.provenance.command.clone()),
            ("Seed of the pictures", number(self.provenance.seed)),
            ("Samples a pixel of the pictures", number(self.provenance.samples)),
            ("Slices read by", self.detection()),
            (
                "Cameras of damage.bcf",
                "in IFC's axes; what an import took off coordinates far from the origin is not \
                 added again"
                    .into(),
            ),
        ]
    }

    /// By what each kind of slice was read; what is not there was not read.
    fn detection(&self) -> String {
        let slices = self.p.members.iter().flat_map(|m| &m.slices);
        let how = |s: &SliceReading| {
            if s.origin == Origin::Scanned { DetectSettings::of_members() } else { self.p.settings }
                .says(s.pixel_mm)
        };
        let all: BTreeSet<String> = slices.map(how).collect();
        if all.is_empty() {
            "no slices were read".into()
        } else {
            all.into_iter().collect::<Vec<_>>().join(" / ")
        }
    }
}

/// A slice's pictures and what was read of it.
fn pair<'m>(slice: &'m SliceReading, [plain, overlay]: &[Picture; 2]) -> Pair<'m> {
    let colour = |[r, g, b]: [u8; 3]| format!("rgb({r},{g},{b})");
    let mut keys = vec![(colour(PORE), "pore"), (colour(CRACK), "crack")];
    if slice.truth.is_some() {
        keys.push((colour(MISSED), "missed"));
    }
    Pair {
        plain: plain.data_url().unwrap_or_default(),
        overlay: overlay.data_url().unwrap_or_default(),
        core: &slice.core,
        name: unmarked(&slice.name),
        drawn: slice.origin == Origin::Drawn,
        pixel_mm: slice.pixel_mm,
        keys,
        porosity: format!(
            "({:.2} ± {:.2})",
            100.0 * slice.porosity.value,
            100.0 * slice.porosity.std_error
        ),
        damage: plus_minus(slice.whole()),
    }
}

fn section(s: &SliceReading, worst: f64) -> Section<'_> {
    let percent = |r: Option<Estimate>| {
        r.map_or_else(
            || NOTHING.into(),
            |r| format!("{:.1} ± {:.1}", 100.0 * r.value, 100.0 * r.std_error),
        )
    };
    let length = s.cracks.iter().map(|c| c.length_mm).sum::<f64>();
    let truth = s.truth.as_ref();
    Section {
        core: &s.core,
        name: &s.name,
        worst: s.whole().value == worst && worst > 0.0,
        cells: [
            s.pores.to_string(),
            format!("{:.2} ± {:.2}", 100.0 * s.porosity.value, 100.0 * s.porosity.std_error),
            s.cracks.len().to_string(),
            cell((!s.cracks.is_empty()).then_some(length), 0),
            cell(s.cracks.iter().map(|c| c.width_mm).reduce(f64::max), 2),
            plus_minus(s.damage),
            percent(s.lost),
            cell(s.steel.map(|s| s.area_mm2), 0),
            cell(s.steel.map(|s| s.laid_mm2), 0),
            percent(s.steel.map(|s| s.loss)),
        ],
        truth: [
            cell(truth.map(|t| 100.0 * t.porosity), 2),
            cell(truth.map(|t| t.damage), 3),
            cell(truth.and_then(|t| t.score.dice), 3),
            cell(truth.and_then(|t| t.score.f1), 3),
        ],
    }
}

/// What was seen on a member: by inspectors with their photographs, or in photographs alone.
fn surveyed(m: &MemberPrediction) -> Option<&Evidence> {
    m.evidence.get(SURVEY).or_else(|| m.evidence.get(PHOTOGRAPHED))
}

/// How much of the bars is lost at each date of inspection, and some years on.
fn course(m: &MemberPrediction) -> Vec<svg::Point> {
    let rust = surveyed(m).and_then(|e| e.details.get("rust"));
    let points = rust.and_then(|rust| rust["course"].as_array());
    let one = |p: &serde_json::Value| {
        let number = |name: &str| p[name].as_f64();
        Some(svg::Point {
            date: p["date"].as_str().map(str::to_owned),
            age_years: number("age_years")?,
            lost: Estimate { value: number("steel_lost")?, std_error: number("std_error")? },
        })
    };
    points.into_iter().flatten().filter_map(one).collect()
}

/// A slice's name without the mark that is told beside it.
fn unmarked(name: &str) -> &str {
    name.strip_suffix(')')
        .and_then(|rest| rest.strip_suffix(MARK)?.strip_suffix(" ("))
        .unwrap_or(name)
}

fn chip(state: &str, level: Option<usize>, is_forecast: bool) -> String {
    let (look, sign) = match level {
        None => ("sx".to_owned(), NOTHING),
        Some(level) if is_forecast => (format!("s{level} forecast"), "◌"),
        Some(level) => (format!("s{level}"), SIGNS[level]),
    };
    Chip { look, sign, state }.to_string()
}

fn cell(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| NOTHING.into(), |v| number(v, digits))
}

/// A number with so many decimals; nothing is not less than nothing.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

fn figure(figure: Option<Figure>, scale: f64, unit: &str, digits: usize) -> [String; 3] {
    let Some(f) = figure else { return [NOTHING.into(), String::new(), "0".into()] };
    let [low, high] = f.ci95.map(|v| scale * v);
    [
        format!("{:.digits$}{unit}", scale * f.value),
        format!("{low:.digits$} to {high:.digits$}{unit}"),
        f.n.to_string(),
    ]
}
