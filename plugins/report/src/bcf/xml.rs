//! The files of a topic as the schemas of BCF 2.1 and 3.0 have them (buildingSMART, *BIM
//! Collaboration Format*, `markup.xsd`, `visinfo.xsd`, `version.xsd`, `extensions.xsd`). Fields
//! stand in the schemas' order, which they insist on.

use serde::Serialize;

/// `bcf.version`.
#[derive(Serialize)]
#[serde(rename = "Version", rename_all = "PascalCase")]
pub(super) struct Edition {
    #[serde(rename = "@VersionId")]
    pub(super) id: &'static str,
    /// 2.1 alone has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) detailed_version: Option<&'static str>,
}

/// `extensions.xml` of 3.0: the words that topics may use.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Extensions {
    pub(super) topic_types: TopicTypes,
    pub(super) topic_statuses: TopicStatuses,
    pub(super) priorities: Priorities,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct TopicTypes {
    pub(super) topic_type: &'static [&'static str],
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct TopicStatuses {
    pub(super) topic_status: &'static [&'static str],
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Priorities {
    pub(super) priority: &'static [&'static str],
}

/// `markup.bcf`. Viewpoints stand beside the topic in 2.1 and in it in 3.0.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Markup {
    pub(super) topic: Topic,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) viewpoints: Option<ViewPoint>,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Topic {
    #[serde(rename = "@Guid")]
    pub(super) guid: String,
    #[serde(rename = "@TopicType")]
    pub(super) topic_type: &'static str,
    #[serde(rename = "@TopicStatus")]
    pub(super) status: &'static str,
    pub(super) title: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) priority: Option<&'static str>,
    pub(super) creation_date: String,
    pub(super) creation_author: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) due_date: Option<String>,
    pub(super) description: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) viewpoints: Option<Viewpoints>,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Viewpoints {
    pub(super) view_point: ViewPoint,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct ViewPoint {
    #[serde(rename = "@Guid")]
    pub(super) guid: String,
    pub(super) viewpoint: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) snapshot: Option<&'static str>,
}

/// `viewpoint.bcfv`.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct VisualizationInfo {
    #[serde(rename = "@Guid")]
    pub(super) guid: String,
    pub(super) components: Components,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) perspective_camera: Option<PerspectiveCamera>,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Components {
    pub(super) selection: Selection,
    pub(super) visibility: Visibility,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Selection {
    pub(super) component: Component,
}

/// A member: by its IFC GlobalId, or by its id in the program that it is from.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Component {
    #[serde(rename = "@IfcGuid", skip_serializing_if = "Option::is_none")]
    pub(super) ifc_guid: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) originating_system: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) authoring_tool_id: Option<String>,
}

#[derive(Serialize)]
pub(super) struct Visibility {
    #[serde(rename = "@DefaultVisibility")]
    pub(super) default: bool,
}

/// Lengths in m, the field of view in degrees.
#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct PerspectiveCamera {
    pub(super) camera_view_point: Vector,
    pub(super) camera_direction: Vector,
    pub(super) camera_up_vector: Vector,
    pub(super) field_of_view: f64,
    /// 3.0 alone has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) aspect_ratio: Option<f64>,
}

#[derive(Serialize)]
#[serde(rename_all = "PascalCase")]
pub(super) struct Vector {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

/// A file's text, without the characters that XML 1.0 §2.2 has no way to write.
pub(super) fn text(value: &impl Serialize) -> Result<String, quick_xml::SeError> {
    let body = quick_xml::se::to_string(value)?;
    let legal = |c: &char| match c {
        '\t' | '\n' | '\r' => true,
        '\u{fffe}' | '\u{ffff}' => false,
        c => *c >= ' ',
    };
    let body: String = body.chars().filter(legal).collect();
    Ok(format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{body}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_cannot_write_is_left_out_and_the_rest_comes_back() {
        let id = "a\u{1}<b>&\"ü\u{ffff}\n".to_owned();
        let component =
            Component { ifc_guid: None, originating_system: None, authoring_tool_id: Some(id) };
        let text = text(&component).expect("text");
        let read: std::collections::HashMap<String, String> =
            quick_xml::de::from_str(&text).expect("XML");
        assert_eq!(read["AuthoringToolId"].trim(), "a<b>&\"ü");
    }
}
