//! Whose structure it is, and why it is looked at.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Date;

/// What stands on the cover of a report.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Project {
    /// Name of the structure, as its owner calls it; the scene's title if absent.
    #[serde(default)]
    pub structure: String,
    /// Where it stands.
    #[serde(default)]
    pub place: String,
    /// Who owns it.
    #[serde(default)]
    pub owner: String,
    /// Who has inspected it.
    #[serde(default)]
    pub inspector: String,
    /// When it was inspected; the last date of its evidence if absent.
    #[serde(default)]
    pub inspected: Option<Date>,
    /// Why it is looked at.
    #[serde(default)]
    pub purpose: String,
}
