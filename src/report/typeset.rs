//! How are the formulas of a plain text set: on a page, in a drawing, in Markdown?
//!
//! Statements of claims, captions and labels are plain text, which files of data and test views keep. Only where it becomes
//! HTML, SVG or Markdown is it set:
//!
//! ```text
//! E_c, x_p(H), u_val    what stands below the line: of the symbols of [`SYMBOLS`] alone
//! 10^-j, V_c^(1/p)      what is raised
//! 1e-12, 2.5e6          10⁻¹², 2.5 × 10⁶
//! `--rtol`, --dt 1e-9   code: an option with its number stays as it is typed
//! -2.5                  −2.5, where no word and no number stands in front
//! V0, fc, +-, ->, <=    V₀, as f_c, ±, →, ≤
//! w dt                  ω Δt
//! 20 %, Eq. 11-12       on one line
//! ```

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};

use super::summary;
use super::text::{one_line, power_of_ten, superscript};

/// Symbols with something below the line. Others that look so are names of files or columns, and stay as they are.
pub(super) const SYMBOLS: [&str; 9] = ["V_c", "V_r", "E_c", "f_c", "x_p", "u_val", "u_num", "u_input", "u_D"];

/// A part of a text, and where it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Line(String),
    Below(String),
    Above(String),
    Code(String),
}

/// The parts of `text`, on one line and harmless.
fn pieces(text: &str) -> Vec<Piece> {
    // A number stays with its percent sign.
    let text = one_line(text).replace(" %", "\u{a0}%");
    let (mut pieces, mut line, mut rest) = (Vec::new(), String::new(), text.as_str());
    while let Some(next) = rest.chars().next() {
        let before = line.chars().last().or_else(|| match pieces.last()? {
            Piece::Below(below) => below.chars().last(),
            _ => Some(' '),
        });
        if let Some((set, after)) = set(rest, before) {
            if let Some(Piece::Line(start)) = set.first() {
                line.push_str(start);
            }
            for piece in set.into_iter().filter(|piece| !matches!(piece, Piece::Line(_))) {
                pieces.extend((!line.is_empty()).then(|| Piece::Line(std::mem::take(&mut line))));
                pieces.push(piece);
            }
            rest = after;
        } else {
            line.push(next);
            rest = &rest[next.len_utf8()..];
        }
    }
    pieces.extend((!line.is_empty()).then_some(Piece::Line(line)));
    pieces
}

/// What begins `rest` and is set in its own way, and what follows it; `before` is the character in front.
fn set(rest: &str, before: Option<char>) -> Option<(Vec<Piece>, &str)> {
    let is_start = before.is_none_or(|c| !c.is_alphanumeric() && !"_.-".contains(c));
    let ends_word = |after: &str| {
        let mut after = after.chars();
        match after.next() {
            Some('.') => after.next().is_none_or(|c| !c.is_alphanumeric()),
            // A square is no letter.
            c => c.is_none_or(|c| !c.is_alphabetic() && !c.is_ascii_digit() && c != '_'),
        }
    };
    if let Some((code, after)) = rest.strip_prefix('`').and_then(|inside| inside.split_once('`')) {
        return Some((vec![Piece::Code(code.to_owned())], after));
    }
    if is_start && let Some(length) = option_with_number(rest) {
        let (option, after) = rest.split_at(length);
        return Some((vec![Piece::Code(option.to_owned())], after));
    }
    // As a terminal has it; V_bl is explained where it stands.
    let others = [
        ("+-", "±"),
        ("->", "→"),
        ("<=", "≤"),
        (">=", "≥"),
        (" - ", " − "),
        ("V0", "V₀"),
        ("V1", "V₁"),
        ("fc", "f_c"),
        ("V_bl", "V_bl"),
        ("w dt", "ω Δt"),
    ];
    for (typed, printed) in others {
        let Some(after) = rest.strip_prefix(typed) else { continue };
        let is_word = typed.starts_with(char::is_alphabetic);
        if !is_word || is_start && ends_word(after) {
            let (base, below) = printed.split_once('_').unwrap_or((printed, ""));
            let pieces = [Piece::Line(base.to_owned()), Piece::Below(below.to_owned())];
            return Some((pieces.into_iter().take(if below.is_empty() { 1 } else { 2 }).collect(), after));
        }
    }
    if is_start
        && let Some(number) = rest.strip_prefix('-')
        && number.starts_with(|c: char| c.is_ascii_digit())
    {
        return Some((vec![Piece::Line("−".to_owned())], number));
    }
    if is_start {
        let symbol = SYMBOLS.into_iter().filter_map(|symbol| Some((symbol, rest.strip_prefix(symbol)?)));
        if let Some((symbol, after)) = symbol.into_iter().find(|(_, after)| ends_word(after)) {
            let (base, below) = symbol.split_once('_')?;
            return Some((vec![Piece::Line(base.to_owned()), Piece::Below(below.to_owned())], after));
        }
        let (mantissa, after) =
            rest.split_at(rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len()));
        if mantissa.starts_with(|c: char| c.is_ascii_digit())
            && let Some(exponent) = after.strip_prefix('e')
        {
            let digits = exponent.strip_prefix(['-', '+']).unwrap_or(exponent);
            let length = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
            let (power, after) = exponent.split_at(exponent.len() - digits.len() + length);
            if let Ok(power) = power.parse()
                && ends_word(after)
            {
                let number = match (mantissa, power) {
                    (_, 0) => mantissa.to_owned(),
                    ("1", _) => power_of_ten(power),
                    _ => format!("{mantissa}\u{a0}×\u{a0}{}", power_of_ten(power)),
                };
                return Some((vec![Piece::Line(number)], after));
            }
        }
    }
    let raised = rest.strip_prefix('^').filter(|_| before.is_some_and(|c| c.is_alphanumeric() || c == ')'))?;
    if let Some((inside, after)) = raised.strip_prefix('(').and_then(|inside| inside.split_once(')')) {
        return Some((vec![Piece::Above(inside.to_owned())], after));
    }
    let digits = raised.strip_prefix('-').unwrap_or(raised);
    let whole = digits.find(|c: char| !c.is_alphanumeric()).unwrap_or(digits.len());
    // A point that ends a sentence is no decimal one.
    let decimals = digits[whole..]
        .strip_prefix('.')
        .map_or(0, |behind| behind.find(|c: char| !c.is_ascii_digit()).unwrap_or(behind.len()));
    let length = if decimals > 0 { whole + 1 + decimals } else { whole };
    let (power, after) = raised.split_at(raised.len() - digits.len() + length);
    let power = match power.parse() {
        Ok(number) => Piece::Line(superscript(number)),
        Err(_) => Piece::Above(power.replace('-', "−")),
    };
    (length > 0).then(|| (vec![power], after))
}

/// The length of the option that begins `text`, together with the number behind it.
fn option_with_number(text: &str) -> Option<usize> {
    let name = text.strip_prefix("--")?;
    let name = &name[..name.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(name.len())];
    let value = text[2 + name.len()..].strip_prefix(' ')?;
    let is_number = value.starts_with(|c: char| c.is_ascii_digit()) && !name.is_empty();
    let end = value.find(|c: char| c.is_whitespace() || ",;)".contains(c)).unwrap_or(value.len());
    is_number.then(|| 3 + name.len() + value[..end].trim_end_matches('.').len())
}

/// `text` on a page.
pub(super) fn html(text: &str) -> Markup {
    html! { @for piece in pieces(text) {
        @match piece {
            Piece::Line(text) => (PreEscaped(equations(&html! { (text) }.into_string()))),
            Piece::Below(text) => sub { (text) },
            Piece::Above(text) => sup { (text) },
            Piece::Code(text) => code { (text) },
        }
    } }
}

/// A text of HTML with each `Eq. 15` and `Eq. 11-12` on one line.
pub(super) fn equations(html: &str) -> String {
    let mut parts = html.split("Eq. ");
    let mut set = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(part.len());
        let (numbers, after) = part.split_at(end);
        // Browsers break behind a hyphen between digits.
        set += &if numbers.contains('-') {
            format!("<span class=\"num\">Eq. {numbers}</span>{after}")
        } else {
            format!("Eq.\u{a0}{part}")
        };
    }
    set
}

/// `text` inside a text of a drawing.
pub(super) fn svg(text: &str) -> Markup {
    // `baseline-shift` is not known everywhere; what follows a shift is shifted back.
    let mut back = 0.0;
    let mut drawn = String::new();
    for piece in pieces(text) {
        let (shift, text) = match piece {
            Piece::Line(text) | Piece::Code(text) => (0.0, text),
            Piece::Below(text) => (0.25, text),
            Piece::Above(text) => (-0.35, text),
        };
        let shown = html! { (text) }.into_string();
        // In units of the text outside: a smaller one has smaller units.
        let size = 0.75;
        let by = if shift == 0.0 { back } else { (shift + back) / size };
        let small = if shift == 0.0 { "" } else { " font-size=\"75%\"" };
        if by == 0.0 && small.is_empty() {
            drawn.push_str(&shown);
        } else {
            let _ = write!(drawn, "<tspan dy=\"{by:.2}em\"{small}>{shown}</tspan>");
        }
        back = -shift;
    }
    PreEscaped(drawn)
}

/// `text` in GitHub's Markdown.
pub(super) fn markdown(text: &str) -> String {
    let piece = |piece| match piece {
        Piece::Line(text) => summary::escape(&text),
        Piece::Below(text) => format!("<sub>{}</sub>", summary::escape(&text)),
        Piece::Above(text) => format!("<sup>{}</sup>", summary::escape(&text)),
        Piece::Code(text) => summary::code(&text),
    };
    pieces(text).into_iter().map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_set_and_names_stay_as_they_are() {
        let page = |text| html(text).into_string();
        assert_eq!(
            page("E_c/(d³ f_c), x_p(H) and u_val/D."),
            "E<sub>c</sub>/(d³ f<sub>c</sub>), x<sub>p</sub>(H) and u<sub>val</sub>/D."
        );
        assert_eq!(page("V₀ = V_c (1 ± 10^-j), 2^-560"), "V₀ = V<sub>c</sub> (1 ± 10<sup>−j</sup>), 2⁻⁵⁶⁰");
        assert_eq!(page("V_c²/2 from 1e-12 to 2.5e6"), "V<sub>c</sub>²/2 from 10⁻¹² to 2.5\u{a0}×\u{a0}10⁶");
        assert_eq!(page("`a_b --rtol 1e-3` runs"), "<code>a_b --rtol 1e-3</code> runs");
        for name in
            ["velocity_m_s", "V_c.toml", "sV_c", "V_c_m", "1e5f", "a1e5", "0x1e5", "^2", "5e", "1.2e", "`open", "E_"]
        {
            assert_eq!(page(name), name);
        }
        assert_eq!(page("fc, V0 +-20, a -> b"), "f<sub>c</sub>, V₀ ±20, a → b");
        assert_eq!(page("fc_mpa, V0x, sfc"), "fc_mpa, V0x, sfc");
        assert_eq!(page("-23.01 to -2.5e6, x-2, 11-12, 1e-3-1"), "−23.01 to −2.5\u{a0}×\u{a0}10⁶, x-2, 11-12, 10⁻³-1");
        assert_eq!(page("h^1.95, h^2. V^-0.5"), "h<sup>1.95</sup>, h². V<sup>−0.5</sup>");
        assert_eq!(page("error 0.0e0, 6.5e0"), "error 0.0, 6.5");
        assert_eq!(page("try --dt 4e-9:4e-7."), "try <code>--dt 4e-9:4e-7</code>.");
        assert_eq!(page("with --peer (10), --"), "with --peer (10), --");
        assert_eq!(page("a (V^p − V_bl^p)^(1/p)"), "a (V<sup>p</sup> − V<sub>bl</sub><sup>p</sup>)<sup>1/p</sup>");
        assert_eq!(page("20 % of 5, Eq. 15"), "20\u{a0}% of 5, Eq.\u{a0}15");
        assert_eq!(page("<Eq. 11-12>"), "&lt;<span class=\"num\">Eq. 11-12</span>&gt;");
        assert_eq!(page("(w dt)²/8 at w dt = 1, raw dt"), "(ω Δt)²/8 at ω Δt = 1, raw dt");
        assert_eq!(page("<b> & V_c"), "&lt;b&gt; &amp; V<sub>c</sub>");
    }

    #[test]
    fn what_follows_a_shift_in_a_drawing_stands_on_the_line_again() {
        let drawn = svg("E_c/(d³ f_c) over <H>").into_string();
        assert_eq!(
            drawn,
            "E<tspan dy=\"0.33em\" font-size=\"75%\">c</tspan><tspan dy=\"-0.25em\">/(d³ f</tspan><tspan dy=\"0.33em\" \
             font-size=\"75%\">c</tspan><tspan dy=\"-0.25em\">) over &lt;H&gt;</tspan>"
        );
        assert_eq!(svg("plain").into_string(), "plain");
    }

    #[test]
    fn markdown_has_no_markup_but_ours() {
        assert_eq!(markdown("a*b V_c `c|d`"), "a\\*b V<sub>c</sub> <code>c\\|d</code>");
    }
}
