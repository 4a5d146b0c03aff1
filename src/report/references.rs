//! What reports cite: one table, from which the list of a page and its BibTeX are made.
//!
//! A DOI stands only where it was looked up. Standards of ASME and books of Hermosa have none.

use std::fmt::Write as _;

use maud::{Markup, html};

/// A published work.
#[derive(Debug, PartialEq, Eq)]
pub struct Reference {
    /// Key in BibTeX, and of citations in a text.
    pub key: &'static str,
    /// Kind of entry in BibTeX.
    kind: &'static str,
    /// Authors or the body that published it, `Initials Family`, parted by ` and `.
    authors: &'static str,
    /// Title.
    title: &'static str,
    /// Where it stands: fields of BibTeX, in the order of a list of references.
    place: &'static [(&'static str, &'static str)],
    /// Year.
    year: u16,
    /// DOI.
    doi: Option<&'static str>,
}

const FLUIDS: &str = "Journal of Fluids Engineering";
const IMPACT: &str = "International Journal of Impact Engineering";

/// Every work that a report may cite.
pub const REFERENCES: [Reference; 18] = [
    Reference {
        key: "zaidi2009",
        kind: "article",
        authors: "A. M. Ahmad Zaidi and I. Abdul Rahman and Q. B. A. I. Latif and M. I. Ghazali",
        title: "Application of Coordinate Resistance Functions on Predicting of Critical Impact Energy of Projectile \
                for Perforation Phenomenon on Concrete Structure",
        place: &[("journal", "Journal of Mathematics Research"), ("volume", "1"), ("number", "2")],
        year: 2009,
        doi: None,
    },
    Reference {
        key: "asme2009",
        kind: "manual",
        authors: "{ASME}",
        title: "V&V 20-2009: Standard for Verification and Validation in Computational Fluid Dynamics and Heat Transfer",
        place: &[("organization", "American Society of Mechanical Engineers")],
        year: 2009,
        doi: None,
    },
    Reference {
        key: "asme2019",
        kind: "manual",
        authors: "{ASME}",
        title: "V&V 10-2019: Standard for Verification and Validation in Computational Solid Mechanics",
        place: &[("organization", "American Society of Mechanical Engineers")],
        year: 2019,
        doi: None,
    },
    Reference {
        key: "aiaa1998",
        kind: "manual",
        authors: "{AIAA}",
        title: "G-077-1998: Guide for the Verification and Validation of Computational Fluid Dynamics Simulations",
        place: &[("organization", "American Institute of Aeronautics and Astronautics")],
        year: 1998,
        doi: Some("10.2514/4.472855"),
    },
    Reference {
        key: "roache1994",
        kind: "article",
        authors: "P. J. Roache",
        title: "Perspective: A Method for Uniform Reporting of Grid Refinement Studies",
        place: &[("journal", FLUIDS), ("volume", "116"), ("number", "3"), ("pages", "405--413")],
        year: 1994,
        doi: Some("10.1115/1.2910291"),
    },
    Reference {
        key: "roache1998",
        kind: "book",
        authors: "P. J. Roache",
        title: "Verification and Validation in Computational Science and Engineering",
        place: &[("publisher", "Hermosa Publishers")],
        year: 1998,
        doi: None,
    },
    Reference {
        key: "celik2008",
        kind: "article",
        authors: "I. B. Celik and U. Ghia and P. J. Roache and C. J. Freitas and H. Coleman and P. E. Raad",
        title: "Procedure for Estimation and Reporting of Uncertainty Due to Discretization in CFD Applications",
        place: &[("journal", FLUIDS), ("volume", "130"), ("number", "7"), ("pages", "078001")],
        year: 2008,
        doi: Some("10.1115/1.2960953"),
    },
    Reference {
        key: "xing2010",
        kind: "article",
        authors: "T. Xing and F. Stern",
        title: "Factors of Safety for Richardson Extrapolation",
        place: &[("journal", FLUIDS), ("volume", "132"), ("number", "6"), ("pages", "061403")],
        year: 2010,
        doi: Some("10.1115/1.4001771"),
    },
    Reference {
        key: "eca2014",
        kind: "article",
        authors: "L. Eça and M. Hoekstra",
        title: "A procedure for the estimation of the numerical uncertainty of CFD calculations based on grid \
                refinement studies",
        place: &[("journal", "Journal of Computational Physics"), ("volume", "262"), ("pages", "104--130")],
        year: 2014,
        doi: Some("10.1016/j.jcp.2014.01.006"),
    },
    Reference {
        key: "oberkampf2010",
        kind: "book",
        authors: "W. L. Oberkampf and C. J. Roy",
        title: "Verification and Validation in Scientific Computing",
        place: &[("publisher", "Cambridge University Press")],
        year: 2010,
        doi: Some("10.1017/CBO9780511760396"),
    },
    Reference {
        key: "salari2000",
        kind: "techreport",
        authors: "K. Salari and P. Knupp",
        title: "Code Verification by the Method of Manufactured Solutions",
        place: &[("institution", "Sandia National Laboratories"), ("number", "SAND2000-1444")],
        year: 2000,
        doi: Some("10.2172/759450"),
    },
    Reference {
        key: "chen2002",
        kind: "article",
        authors: "X. W. Chen and Q. M. Li",
        title: "Deep penetration of a non-deformable projectile with different geometrical characteristics",
        place: &[("journal", IMPACT), ("volume", "27"), ("number", "6"), ("pages", "619--637")],
        year: 2002,
        doi: None,
    },
    Reference {
        key: "li2003",
        kind: "article",
        authors: "Q. M. Li and X. W. Chen",
        title: "Dimensionless formulae for penetration depth of concrete target impacted by a non-deformable projectile",
        place: &[("journal", IMPACT), ("volume", "28"), ("number", "1"), ("pages", "93--116")],
        year: 2003,
        doi: Some("10.1016/S0734-743X(02)00037-4"),
    },
    Reference {
        key: "tong2003",
        kind: "article",
        authors: "Q. M. Li and D. J. Tong",
        title: "Perforation thickness and ballistic performance of concrete target subjected to rigid projectile impact",
        place: &[
            ("journal", "Journal of Engineering Mechanics"),
            ("volume", "129"),
            ("number", "9"),
            ("pages", "1083--1091"),
        ],
        year: 2003,
        doi: None,
    },
    Reference {
        key: "forrestal1994",
        kind: "article",
        authors: "M. J. Forrestal and B. S. Altman and J. D. Cargile and S. J. Hanchak",
        title: "An empirical equation for penetration depth of ogive-nose projectiles into concrete targets",
        place: &[("journal", IMPACT), ("volume", "15"), ("number", "4"), ("pages", "395--405")],
        year: 1994,
        doi: None,
    },
    Reference {
        key: "kennedy1976",
        kind: "article",
        authors: "R. P. Kennedy",
        title: "A review of procedures for the analysis and design of concrete structures to resist missile impact effects",
        place: &[
            ("journal", "Nuclear Engineering and Design"),
            ("volume", "37"),
            ("number", "2"),
            ("pages", "183--203"),
        ],
        year: 1976,
        doi: None,
    },
    Reference {
        key: "bainbridge1988",
        kind: "misc",
        authors: "P. Bainbridge",
        title: "Measured critical energies, cited in the text of the paper and absent from its list of references",
        place: &[],
        year: 1988,
        doi: None,
    },
    Reference {
        key: "jorba2005",
        kind: "article",
        authors: "À. Jorba and M. Zou",
        title: "A software package for the numerical integration of ODEs by means of high-order Taylor methods",
        place: &[("journal", "Experimental Mathematics"), ("volume", "14"), ("number", "1"), ("pages", "99--117")],
        year: 2005,
        doi: Some("10.1080/10586458.2005.10128904"),
    },
];

/// The work of this key.
pub fn reference(key: &str) -> Option<&'static Reference> {
    REFERENCES.iter().find(|reference| reference.key == key)
}

/// A list of works on a page, numbered from 1.
pub(super) fn list(works: &[&Reference]) -> Markup {
    html! { ol.references { @for work in works { li id={ "ref-" (work.key) } { (work.to_html()) } } } }
}

/// A citation on a page: numbers of `works` by their place in `cited`.
pub(super) fn citation(works: &[&Reference], cited: &[&Reference]) -> Markup {
    let number = |work: &Reference| 1 + cited.iter().position(|other| other.key == work.key).unwrap_or(cited.len());
    html! { "["
        @for (index, work) in works.iter().enumerate() {
            @if index > 0 { ", " }
            a href={ "#ref-" (work.key) } { (number(work)) }
        }
    "]" }
}

impl Reference {
    /// A field of its place.
    fn field(&self, name: &str) -> Option<&'static str> {
        self.place.iter().find(|(field, _)| *field == name).map(|(_, value)| *value)
    }

    /// As in a list of references, with the DOI as a link.
    pub(super) fn to_html(&self) -> Markup {
        let authors = self.authors.replace(" and ", ", ").replace(['{', '}'], "");
        let number = self.field("number");
        html! {
            (authors) ". " cite { (self.title) } ". "
            @for name in ["journal", "publisher", "organization", "institution"] {
                @if let Some(value) = self.field(name) { (value) }
            }
            @if let Some(volume) = self.field("volume") {
                " " (volume) @if let Some(number) = number { "(" (number) ")" }
            } @else if let Some(number) = number { ", " (number) }
            @if let Some(pages) = self.field("pages") { ", " (pages.replace("--", "–")) }
            @if !self.place.is_empty() { ", " } (self.year) "."
            @if let Some(doi) = self.doi { " doi:" a href={ "https://doi.org/" (doi) } { (doi) } "." }
        }
    }

    /// As an entry of BibTeX.
    pub(super) fn to_bibtex(&self) -> String {
        let year = self.year.to_string();
        // Capitals of a title stay where a style would take them away.
        let title = format!("{{{}}}", self.title);
        let mut fields = vec![("author", self.authors), ("title", title.as_str())];
        fields.extend(self.place);
        fields.push(("year", &year));
        fields.extend(self.doi.map(|doi| ("doi", doi)));
        let mut entry = format!("@{}{{{}", self.kind, self.key);
        for (name, value) in fields {
            let _ = write!(
                entry,
                ",\n  {name} = {{{}}}",
                value.replace('&', "\\&").replace('ç', "{\\c c}").replace('À', "{\\`A}")
            );
        }
        entry + "\n}\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_and_doi_stands_once_and_every_entry_is_whole() {
        for (index, reference) in REFERENCES.iter().enumerate() {
            for other in &REFERENCES[..index] {
                assert_ne!(reference.key, other.key);
                assert!(reference.doi.is_none() || reference.doi != other.doi, "{}", reference.key);
            }
            let entry = reference.to_bibtex();
            assert!(entry.is_ascii(), "{entry}");
            assert_eq!(entry.matches('{').count(), entry.matches('}').count(), "{entry}");
            assert!(reference.doi.is_none_or(|doi| doi.starts_with("10.") && doi.contains('/')));
            assert_eq!(super::reference(reference.key), Some(reference));
        }
    }

    #[test]
    fn a_work_is_shown_with_its_link_and_in_bibtex() {
        let celik = reference("celik2008").map(Reference::to_html).map(maud::PreEscaped::into_string);
        let shown = "<cite>Procedure for Estimation and Reporting of Uncertainty Due to Discretization in CFD \
                     Applications</cite>. Journal of Fluids Engineering 130(7), 078001, 2008. doi:<a \
                     href=\"https://doi.org/10.1115/1.2960953\">10.1115/1.2960953</a>.";
        assert!(celik.is_some_and(|celik| celik.ends_with(shown)));
        let entry = reference("salari2000").map(Reference::to_bibtex);
        let lines = "@techreport{salari2000,\n  author = {K. Salari and P. Knupp},\n  title = {{Code Verification by the \
                     Method of Manufactured Solutions}},\n  institution = {Sandia National Laboratories},\n  number = \
                     {SAND2000-1444},\n  year = {2000},\n  doi = {10.2172/759450}\n}\n";
        assert_eq!(entry.as_deref(), Some(lines));
    }
}
