//! The ledger of evidence. Every item that a scene gives (a slice, a reading), that the program
//! makes (a life, readings simulated from planted truth) or that another plugin brings stands in it
//! exactly once: as *used*, or as *not used, because …*.

use serde::Serialize;

/// One item of evidence, and what became of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Item {
    /// Id of the member; empty: of none.
    pub member: String,
    /// Which source it belongs to: `"ct"`, `"gauges"`, `"forecast"`, `"survey"`, or another plugin's.
    pub source: &'static str,
    /// What it is, for people; unique within member and source.
    pub item: String,
    /// Whether the prediction rests on it.
    pub used: bool,
    /// Why not, one line.
    pub why: Option<String>,
}

impl Item {
    /// An item that is used unless there is a reason why not.
    pub fn new(
        member: impl Into<String>,
        source: &'static str,
        item: impl Into<String>,
        why: Option<String>,
    ) -> Self {
        let why = why.map(|why| why.split_whitespace().collect::<Vec<_>>().join(" "));
        Self { member: member.into(), source, item: item.into(), used: why.is_none(), why }
    }

    /// `"used"`, or `"not used, because …"`.
    #[must_use]
    pub fn verdict(&self) -> String {
        self.why.as_ref().map_or("used".into(), |why| format!("not used, because {why}"))
    }
}

/// Items of one member and source in a row that met the same fate, for people: one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Group<'a>(&'a [Item]);

impl<'a> Group<'a> {
    /// All items, in their order.
    #[must_use]
    pub fn all(items: &'a [Item]) -> Vec<Self> {
        items
            .chunk_by(|a, b| (&a.member, a.source, &a.why) == (&b.member, b.source, &b.why))
            .map(Self)
            .collect()
    }

    /// The first item, which stands for all in member, source and verdict.
    #[must_use]
    pub fn first(&self) -> &'a Item {
        &self.0[0]
    }

    /// What it is: the item, or the first and the last of several and how many.
    #[must_use]
    pub fn name(&self) -> String {
        match self.0 {
            [one] => one.item.clone(),
            [one, two] => format!("{}; {}", one.item, two.item),
            [first, .., last] => format!("{} … {} ({})", first.item, last.item, self.0.len()),
            [] => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_items_share_a_line() {
        let why = |n: usize| (n == 3).then(|| "the file\nis damaged".to_owned());
        let items: Vec<Item> =
            (0..6).map(|n| Item::new("C1", "ct", format!("slice {n}"), why(n))).collect();
        let lines: Vec<(String, String)> =
            Group::all(&items).iter().map(|g| (g.name(), g.first().verdict())).collect();
        let line = |name: &str, verdict: &str| (name.to_owned(), verdict.to_owned());
        let expected = [
            line("slice 0 … slice 2 (3)", "used"),
            line("slice 3", "not used, because the file is damaged"),
            line("slice 4; slice 5", "used"),
        ];
        assert_eq!(lines, expected);
    }
}
