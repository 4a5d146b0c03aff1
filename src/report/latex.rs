//! LaTeX for a paper: text in which nothing acts, symbols, and tables after `booktabs`.
//!
//! What is written compiles with `pdflatex` and the packages that [`PREAMBLE`] names.

use std::fmt::Write as _;

use super::study::{Cell, Prose, Sheet, Symbol};

/// What a document needs for the tables: a comment at the head of the file.
pub(super) const PREAMBLE: &str = "% \\usepackage{booktabs}, and UTF-8 input, which is LaTeX's own since 2018.\n";

/// Width of a table at most, in characters of a small type: more columns stand in a further table.
const WIDTH: usize = 78;
/// Space between columns in such characters.
const GAP: usize = 3;

/// `text` in which nothing is LaTeX. Letters beyond those of Western Europe become question marks.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\\' => escaped.push_str("\\textbackslash{}"),
            '{' | '}' | '$' | '&' | '#' | '_' | '%' => escaped.extend(['\\', c]),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '<' => escaped.push_str("\\ensuremath{<}"),
            '>' => escaped.push_str("\\ensuremath{>}"),
            '|' => escaped.push_str("\\ensuremath{|}"),
            '"' => escaped.push_str("''"),
            '`' => escaped.push_str("\\textasciigrave{}"),
            // Two of them would be one dash.
            '-' if chars.peek() == Some(&'-') => escaped.push_str("-{}"),
            '\u{a0}' => escaped.push('~'),
            '−' => escaped.push_str("\\ensuremath{-}"),
            '×' => escaped.push_str("\\ensuremath{\\times}"),
            '·' => escaped.push_str("\\ensuremath{\\cdot}"),
            '±' => escaped.push_str("\\ensuremath{\\pm}"),
            '≤' => escaped.push_str("\\ensuremath{\\le}"),
            '≥' => escaped.push_str("\\ensuremath{\\ge}"),
            '∞' => escaped.push_str("\\ensuremath{\\infty}"),
            'µ' => escaped.push_str("\\ensuremath{\\mu}"),
            'Δ' => escaped.push_str("\\ensuremath{\\Delta}"),
            '–' => escaped.push_str("--"),
            '—' => escaped.push_str("---"),
            '…' => escaped.push_str("\\dots{}"),
            c if raised(c).is_some() => {
                let mut exponent: String = raised(c).into_iter().collect();
                while let Some(next) = chars.peek().copied().and_then(raised) {
                    exponent.push(next);
                    chars.next();
                }
                let _ = write!(escaped, "\\ensuremath{{^{{{exponent}}}}}");
            }
            '\n' | '\r' | '\t' => escaped.push(' '),
            ' '..='~' | 'À'..='ÿ' => escaped.push(c),
            _ => escaped.push('?'),
        }
    }
    escaped
}

/// The sign that stands raised as `c`.
fn raised(c: char) -> Option<char> {
    Some(match c {
        '⁻' => '-',
        '¹' => '1',
        '²' => '2',
        '³' => '3',
        '⁰' | '⁴'..='⁹' => char::from_u32(u32::from(c) - 0x2070 + u32::from('0'))?,
        _ => return None,
    })
}

/// A symbol with what is below and above the line.
pub(super) fn symbol(Symbol { base, below, above }: Symbol) -> String {
    let upright = |text: &str| {
        let is_word = text.chars().count() > 1 && !text.bytes().all(|byte| byte.is_ascii_digit());
        if is_word { format!("\\mathrm{{{text}}}") } else { text.to_owned() }
    };
    let part = |sign, text: &str| if text.is_empty() { String::new() } else { format!("{sign}{{{}}}", upright(text)) };
    let base = base.strip_prefix('Δ').map_or_else(|| upright(base), |rest| format!("\\Delta {rest}"));
    format!("${base}{}{}$", part("_", below), part("^", above))
}

/// The columns `of` a sheet in parts that fit a page, the first column of the sheet apart.
fn parts_of(sheet: &Sheet, of: &[usize]) -> Vec<Vec<usize>> {
    let width = |column: usize| {
        let cells = sheet.rows.iter().filter_map(|row| row.get(column)).map(Cell::plain);
        cells.chain(sheet.header.get(column).map(Prose::plain)).map(|text| text.chars().count()).max().unwrap_or(0)
            + GAP
    };
    let mut parts: Vec<Vec<usize>> = Vec::new();
    let mut left = 0;
    for &column in of {
        if let Some(part) = parts.last_mut().filter(|_| width(column) <= left) {
            part.push(column);
        } else {
            left = WIDTH.saturating_sub(width(0));
            parts.push(vec![column]);
        }
        left = left.saturating_sub(width(column));
    }
    parts
}

/// Columns of `sheet` as a table, or as several where they are many; `label` names it.
pub(super) fn table(sheet: &Sheet, columns: &[usize], label: &str) -> String {
    let all = parts_of(sheet, columns);
    let parts = all.len();
    let mut text = String::new();
    for (index, columns) in all.iter().enumerate() {
        let row = |cells: &dyn Fn(usize) -> String| {
            let cells = [0].iter().chain(columns).map(|&column| cells(column));
            format!("    {} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
        };
        let (mut caption, mut label) = (sheet.caption.latex(), format!("tab:{label}"));
        if parts > 1 {
            let _ = write!(caption, " ({} of {parts})", index + 1);
            let _ = write!(label, "-{}", index + 1);
        }
        let _ = write!(
            text,
            "\\begin{{table}}\n  \\centering\\small\n  \\caption{{{caption}.}}\n  \\label{{{label}}}\n  \\begin{{tabular}}{{l{}}}\n    \
             \\toprule\n{}    \\midrule\n",
            "r".repeat(columns.len()),
            row(&|column| sheet.header[column].latex()),
        );
        for cells in &sheet.rows {
            text.push_str(&row(&|column| cells.get(column).map_or(String::new(), Cell::latex)));
        }
        text.push_str("    \\bottomrule\n  \\end{tabular}\n\\end{table}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_a_text_acts() {
        assert_eq!(
            escape("50 % of $a_b & \\c{d}# ~^"),
            "50 \\% of \\$a\\_b \\& \\textbackslash{}c\\{d\\}\\# \\textasciitilde{}\\textasciicircum{}"
        );
        assert_eq!(
            escape("1.5\u{a0}×\u{a0}10⁻¹³ Eça 中\n-- "),
            "1.5~\\ensuremath{\\times}~10\\ensuremath{^{-13}} Eça ? -{}- "
        );
    }

    #[test]
    fn symbols_are_set() {
        for (base, below, above, set) in [
            ("p", "", "", "$p$"),
            ("GCI", "", "", "$\\mathrm{GCI}$"),
            ("Δt", "", "", "$\\Delta t$"),
            ("r", "21", "p", "$r_{21}^{p}$"),
            ("f", "ext", "", "$f_{\\mathrm{ext}}$"),
        ] {
            assert_eq!(symbol(Symbol { base, below, above }), set);
        }
    }
}
