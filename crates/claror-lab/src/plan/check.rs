//! What a plan must agree on with itself.

use toml::Spanned;

use super::{Contender, Plan, SeriesPlan};

/// What is wrong and where, in bytes.
pub(super) struct Mistake {
    pub(super) message: String,
    pub(super) at: Option<usize>,
}

fn mistake(message: impl Into<String>, at: &Spanned<String>) -> Result<(), Mistake> {
    Err(Mistake { message: message.into(), at: Some(at.span().start) })
}

pub(super) fn check(plan: &Plan) -> Result<(), Mistake> {
    for (i, series) in plan.series.iter().enumerate() {
        check_series(series)?;
        let name = series.name.get_ref();
        if plan.series[..i].iter().any(|other| other.name.get_ref() == name) {
            return mistake(format!("two series are called `{name}`"), &series.name);
        }
    }
    let contenders = plan.equal_time.iter().flat_map(|equal| &equal.contenders);
    for contender in contenders {
        check_contender(plan, contender)?;
    }
    for equal in &plan.equal_time {
        for (i, contender) in equal.contenders.iter().enumerate() {
            let name = contender.series.get_ref();
            if equal.contenders[..i].iter().any(|other| other.series.get_ref() == name) {
                return mistake(format!("`{name}` competes twice"), &contender.series);
            }
        }
    }
    if plan.series.is_empty() && plan.lookups.is_none() {
        let message = "the plan measures nothing: it has neither [[series]] nor [lookups]";
        return Err(Mistake { message: message.to_owned(), at: None });
    }
    Ok(())
}

fn check_series(series: &SeriesPlan) -> Result<(), Mistake> {
    let name = series.name.get_ref();
    let good = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if name.is_empty() || !name.chars().all(good) {
        let message = "a series' name is made of letters, digits, `-`, `_` and `.`";
        return mistake(message, &series.name);
    }
    let sweeps = series.spp.as_ref().is_some_and(|spp| spp.is_list()) || !series.vary.0.is_empty();
    if sweeps && !series.steps.is_empty() {
        let message = format!("series `{name}` has steps and a sweep: allowed is one of them");
        return mistake(message, &series.name);
    }
    if series.cumulative && series.steps.is_empty() {
        return mistake(format!("series `{name}` is cumulative but has no steps"), &series.name);
    }
    Ok(())
}

fn check_contender(plan: &Plan, contender: &Contender) -> Result<(), Mistake> {
    let name = contender.series.get_ref();
    let names: Vec<&str> =
        plan.series.iter().map(|series| series.name.get_ref().as_str()).collect();
    if !names.contains(&name.as_str()) {
        let message = format!("there is no series `{name}`; the plan has {}", names.join(", "));
        return mistake(message, &contender.series);
    }
    match (&contender.knob, contender.from, contender.to) {
        (None, None, None) => Ok(()),
        (Some(knob), Some(from), Some(to)) => {
            let good = |v: f64| v > 0.0 && v.is_finite();
            if good(from) && good(to) && from != to {
                return Ok(());
            }
            mistake("`from` and `to` must be two different numbers above 0", knob)
        }
        (Some(knob), ..) => mistake(
            "a knob needs `from`, where the picture is fast, and `to`, where it is slow",
            knob,
        ),
        (None, ..) => mistake("`from` and `to` belong to a `knob`", &contender.series),
    }
}
