//! What is known of an input while it is on its way: values that stages add to, and of which the report is made once, at
//! the end. So a report never holds what a stage that broke down has left behind.

use super::{
    ChartReport, Decomposition, ExportReport, FieldReport, Input, LabelReport, MmgReport, Output, Refinement,
    RefusedComponent, Repairs, Report, Seams, Surface, Warning,
};
use crate::formats::{Fields, Notes};
use crate::outcome::{Reason, Status};
use crate::settings::Settings;
use planish_core::repair::Repaired;
use std::sync::Arc;

/// What is known of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// The file.
    pub input: Input,
    /// What it holds beside its triangles; none where it was not read to its end.
    pub content: Option<Notes>,
    /// What it tells at points and cells, with an entry for each vertex after welding.
    pub fields: Arc<Fields>,
    /// Its surface; none where it was not repaired.
    pub surface: Option<SurfaceFacts>,
}

/// What is known of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceFacts {
    /// Its counts, before and after repair.
    pub surface: Surface,
    /// What repair did.
    pub repairs: Repairs,
    /// What it may suffer from all the same.
    pub warnings: Vec<Warning>,
    /// The components of which no atlas is made.
    pub refused: Vec<RefusedComponent>,
    /// How it was cut into charts; none where it was not.
    pub decomposition: Option<Decomposition>,
    /// What was refined; none where that was not looked at.
    pub refinement: Option<Refinement>,
}

/// What is known of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct CertifiedFacts {
    /// The parts of its surface that have names.
    pub labels: Vec<LabelReport>,
    /// The fields of the input on it.
    pub fields: Vec<FieldReport>,
    /// Its charts.
    pub charts: Vec<ChartReport>,
    /// How many of them there are more than decomposition made.
    pub charts_by_splitting: usize,
    /// The curves between them.
    pub seams: Seams,
    /// What was handed to a mesher; none where that was not asked for.
    pub hand_off: Option<ExportReport>,
    /// What was handed to Mmg; none where that was not asked for.
    pub mmg: Option<MmgReport>,
    /// The files of the result.
    pub outputs: Vec<Output>,
}

impl SurfaceFacts {
    /// What is known of a surface after its repair.
    pub fn of(found: &Repaired) -> Self {
        Self {
            surface: super::surface(found),
            repairs: super::repairs(&found.report),
            warnings: super::warnings(found),
            refused: vec![],
            decomposition: None,
            refinement: None,
        }
    }
}

impl Facts {
    /// What is known of an input before it is decoded.
    pub fn new(input: Input) -> Self {
        Self { input, content: None, fields: Arc::default(), surface: None }
    }

    /// The report of an input for which there are no maps yet: all that is known, and no result.
    pub fn report(self, settings: &Settings) -> Report {
        let report = Report { content: self.content, ..Report::new(self.input, settings) };
        let Some(SurfaceFacts { surface, repairs, warnings, refused, decomposition, refinement }) = self.surface else {
            return report;
        };
        Report {
            surface: Some(surface),
            repairs: Some(repairs),
            warnings,
            refused_components: refused,
            decomposition,
            refinement,
            ..report
        }
    }

    /// The report of an input that is certified, but for components that are refused.
    pub fn certified(self, settings: &Settings, certified: CertifiedFacts) -> Report {
        let CertifiedFacts { labels, fields, charts, charts_by_splitting, seams, hand_off, mmg, outputs } = certified;
        let report = self.report(settings);
        let decomposition = report.decomposition.map(|d| Decomposition { charts_by_splitting, ..d });
        let status = Status::Certified;
        Report { status, decomposition, labels, fields, charts, seams, hand_off, mmg, outputs, ..report }
    }

    /// The report of an input that is refused, or failed, for this reason.
    pub fn stopped(mut self, settings: &Settings, reason: Reason) -> Report {
        if let Some(surface) = &mut self.surface {
            // How many charts there would have been is not known to its end.
            surface.decomposition = None;
            surface.refinement = None;
        }
        Report { status: reason.status(), reason: Some(reason), ..self.report(settings) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::Code;
    use crate::settings::RawSettings;
    use planish_core::{repair, shapes};

    fn facts() -> Facts {
        let input = Input { name: "a.stl".to_owned(), bytes: Some(7), blake3: Some("00".to_owned()), beside: vec![] };
        let found = repair(&shapes::disk(2), &Default::default()).expect("a surface");
        Facts { surface: Some(SurfaceFacts::of(&found)), ..Facts::new(input) }
    }

    #[test]
    fn a_refused_input_tells_what_is_known_of_it_and_nothing_of_a_result() {
        let settings = RawSettings::default().check().expect("in range");
        for (code, status) in [(Code::TooLarge, Status::Refused), (Code::Internal, Status::Failed)] {
            let report = facts().stopped(&settings, Reason::new(code, "for the test"));
            assert_eq!((report.status, report.reason.expect("one").code), (status, code));
            assert_eq!(report.surface.expect("repaired").repaired.counts.components, 1);
            assert_eq!((report.charts.len(), report.outputs.len(), report.hand_off), (0, 0, None));
            assert_eq!((report.input.bytes, report.decomposition), (Some(7), None));
        }
    }

    #[test]
    fn an_input_that_was_not_read_has_no_surface() {
        let settings = RawSettings::default().check().expect("in range");
        let unread = Facts { surface: None, ..facts() };
        let report = unread.stopped(&settings, Reason::new(Code::Malformed, "for the test"));
        assert_eq!((report.surface, report.repairs, report.warnings.len()), (None, None, 0));
    }
}
