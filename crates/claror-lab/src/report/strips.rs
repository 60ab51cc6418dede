//! Pictures side by side: equal times, steps, and the comparer.

use maud::{Markup, PreEscaped, html};

use super::findings::contenders;
use super::number::rich;
use super::pictures::{Shown, alt};
use super::{Scene, number};
use crate::study::{Illustration, Setting};

/// Strips of pictures made in the same time.
pub(super) fn equal_time(scene: &Scene<'_>) -> Markup {
    let mut rows: Vec<_> = scene.study.equal_time.iter().collect();
    rows.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    if rows.is_empty() {
        return PreEscaped(String::new());
    }
    html! {
        h3 id={(scene.slug) "-equal-time"} { "Equal time" }
        p { "From top to bottom: the picture, its signed difference to the reference, and where the difference is visible (FLIP). The numbers are medians over the seeds, the pictures those of the first seed." (reduced(scene)) }
        @for row in rows {
            h4 { "About " (number::plain(row.seconds)) "\u{202f}s of wall-clock time" }
            div.strip.rows tabindex="0" role="region" aria-label={"Pictures made in about " (number::plain(row.seconds)) " s"} {
                (reference(scene))
                @for (series, index, setting) in contenders(scene.study, row) {
                    @let place = scene.study.series.iter().position(|s| std::ptr::eq(s, series)).map(|i| (i, index));
                    @let shown = place.and_then(|p| scene.pictures.of(p));
                    figure {
                        p.name { strong { (series.label) } br; (setting.label) }
                        (picture(scene, shown.and_then(|s| s.png.as_ref()), "Picture", &series.label, &setting.label))
                        (picture(scene, shown.and_then(|s| s.signed.as_ref()), "Signed difference", &series.label, &setting.label))
                        (picture(scene, shown.and_then(|s| s.flip.as_ref()), "FLIP map", &series.label, &setting.label))
                        figcaption { (numbers(setting)) (compare_button(scene, place, &series.label, &setting.label)) }
                    }
                }
            }
        }
    }
}

fn reduced(scene: &Scene<'_>) -> String {
    match scene.pictures.reduced {
        0 | 1 => String::new(),
        n => format!(" They are shown at 1/{n} of their size; the comparer has all pixels."),
    }
}

/// What the colours of the maps mean, beside the rows of the strip.
fn keys(scene: &Scene<'_>) -> Markup {
    let scale = number::plain(f64::from(scene.pictures.signed_scale));
    html! {
        div.key {
            strong { "Signed difference" }
            span.ramp.signed role="img" aria-label="from blue over black to red" {}
            span.ends { span { "−" (scale) } span { "+" (scale) } }
            span { "Blue is too dark, red too bright." }
        }
        div.key {
            strong { "FLIP" }
            span.ramp.magma role="img" aria-label="from black over purple and orange to pale yellow" {}
            span.ends { span { "0" } span { "1" } }
            span { "How visible the difference is." }
        }
    }
}

fn reference(scene: &Scene<'_>) -> Markup {
    let png = scene.pictures.reference.as_ref().and_then(|r| r.png.as_ref());
    html! {
        figure {
            p.name { strong { "Reference" } br; @if scene.study.reference.spp > 0 { (number::whole(scene.study.reference.spp as f64)) " spp" } @else { "given" } }
            (picture(scene, png, "Picture", "Reference", ""))
            (keys(scene))
            figcaption { dl.numbers { div { dt { "CPU" } dd { (number::seconds(scene.study.reference.cpu_seconds)) } } div { dt { "relMSE" } dd { "≈ " (rich(&number::scientific(scene.study.reference.rel_mse))) } } } }
        }
    }
}

fn picture(
    scene: &Scene<'_>,
    address: Option<&String>,
    what: &str,
    label: &str,
    setting: &str,
) -> Markup {
    let label = if setting.is_empty() { label.to_owned() } else { format!("{label}, {setting}") };
    let [width, height] = scene.study.size;
    html! {
        @match address {
            Some(address) => img src=(address) width=(width) height=(height) decoding="async" alt=(alt(what, &label, &scene.study.name));,
            None => div.missing style={"aspect-ratio:" (width.max(1)) "/" (height.max(1))} { span { (what) " missing" } },
        }
    }
}

/// Time and errors of a setting.
fn numbers(setting: &Setting) -> Markup {
    html! {
        @match &setting.summary {
            Some(s) => dl.numbers {
                div { dt { "Wall" } dd { (number::seconds(s.seconds.median)) } }
                div { dt { "CPU" } dd { (number::seconds(s.cpu_seconds.median)) } }
                div { dt { "relMSE" } dd { (rich(&number::scientific(s.rel_mse.median))) } }
                div { dt { "Bias" } dd { (number::percent(s.bias.median, true)) } }
                div { dt { "FLIP" } dd { (number::fraction(s.flip.median)) } }
            },
            None => p.muted { "No finished run." },
        }
    }
}

fn compare_button(
    scene: &Scene<'_>,
    place: Option<(usize, usize)>,
    label: &str,
    setting: &str,
) -> Markup {
    let has_data = place.and_then(|p| scene.pictures.of(p)).is_some_and(|s| s.packed.is_some());
    html! {
        @if let (Some((i, j)), true) = (place, has_data) {
            button.to-comparer type="button" hidden data-comparer={(scene.slug) "-comparer"} data-picture={(i) "-" (j)}
                aria-label={"Examine " (label) ", " (setting) " in the comparer"} { "Examine" }
        }
    }
}

/// A series setting by setting: each as a figure of its own.
pub(super) fn steps(scene: &Scene<'_>, index: usize) -> Markup {
    let series = &scene.study.series[index];
    html! {
        h3 { (series.label) ", step by step" }
        @if !series.note.is_empty() { p { (series.note) } }
        ol.steps { @for (j, setting) in series.settings.iter().enumerate() {
            @let place = (index, j);
            @let shown = scene.pictures.of(place);
            li {
                h4 { (setting.label) }
                @if !setting.note.is_empty() { p { (setting.note) } }
                @for failure in &setting.failures { p.warning { strong { "Failed: " } (failure) } }
                div.strip tabindex="0" role="region" aria-label={"Pictures of " (setting.label)} {
                    figure { (picture(scene, shown.and_then(|s| s.png.as_ref()), "Picture", &series.label, &setting.label)) figcaption { "Result " (compare_button(scene, Some(place), &series.label, &setting.label)) } }
                    @for (one, made) in illustrations(scene, place, setting) { (illustration(scene, one, made, &setting.label)) }
                    figure { (picture(scene, shown.and_then(|s| s.signed.as_ref()), "Signed difference", &series.label, &setting.label)) figcaption { "Signed difference, ±" (number::plain(f64::from(scene.pictures.signed_scale))) ": red too bright, blue too dark" } }
                }
                div.inline-numbers { (numbers(setting)) }
            }
        } }
    }
}

type Made<'a> = &'a Result<String, String>;

fn illustrations<'a>(
    scene: &'a Scene<'_>,
    place: (usize, usize),
    setting: &'a Setting,
) -> Vec<(&'a Illustration, Made<'a>)> {
    let made = scene.illustrations.get(&place);
    made.map(|made| setting.illustrations.iter().zip(made).collect()).unwrap_or_default()
}

fn illustration(scene: &Scene<'_>, one: &Illustration, made: Made<'_>, label: &str) -> Markup {
    html! {
        figure {
            (picture(scene, made.as_ref().ok(), &one.title, label, ""))
            figcaption { (one.title.chars().take(1).flat_map(char::to_uppercase).chain(one.title.chars().skip(1)).collect::<String>()) }
        }
    }
}

/// The comparer of all pictures of a scene, with their data.
pub(super) fn comparer(scene: &Scene<'_>) -> Markup {
    let reference = scene.pictures.reference.as_ref().map(|r| ("reference".to_owned(), r));
    let others = scene.pictures.shown.iter().map(|s| (format!("{}-{}", s.place.0, s.place.1), s));
    let all: Vec<(String, &Shown)> =
        reference.into_iter().chain(others).filter(|(_, s)| s.packed.is_some()).collect();
    if all.is_empty() {
        return PreEscaped(String::new());
    }
    let id = format!("{}-comparer", scene.slug);
    let [width, height] = scene.study.size;
    html! {
        h3.noprint { "Compare pictures" }
        p.noprint { "High dynamic range, half floats, first seeds. Choose two pictures; zoom to see pixels and their radiance." }
        noscript { p.warning { "The comparer needs JavaScript. The pictures are in the folder runs/." } }
        div.comparer id=(id) hidden data-width=(width) data-height=(height) data-scale=(scene.pictures.signed_scale) {
            (controls(&id, &all, first_choice(scene, &all)))
            div.stage {
                canvas tabindex="0" role="application" aria-label={"Comparer of pictures of " (scene.study.name)} aria-describedby={(id) "-keys"} {}
                p.shown aria-live="polite" {}
            }
            output.pixel { "Point at a pixel to read its radiance." }
            (key_list(&id))
            @for (name, shown) in &all { @if let Some(packed) = &shown.packed {
                script type="text/plain" data-picture=(name) { (PreEscaped(&packed.colors)) }
                @if let Some(flip) = &packed.flip { script type="text/plain" data-flip=(name) { (PreEscaped(flip)) } }
            } }
        }
    }
}

fn controls(id: &str, all: &[(String, &Shown)], [first, second]: [String; 2]) -> Markup {
    let choice = |which: &str, selected: &str| {
        html! {
            label { span { (which) } select data-choice=(which) { @for (name, shown) in all { option value=(name) selected[name == selected] { (shown.label) } } } }
        }
    };
    html! {
        div.controls {
            (choice("A", &first)) (choice("B", &second))
            fieldset.modes {
                legend { "Show" }
                @for (value, text) in [("wipe", "Wipe"), ("flip", "Flip"), ("difference", "Difference"), ("visible", "FLIP of A")] {
                    label { input type="radio" name={(id) "-mode"} value=(value) checked[value == "wipe"]; span { (text) } }
                }
            }
            label.exposure { span { "Exposure " output { "0.0" } } input type="range" min="-8" max="8" step="0.25" value="0" data-exposure aria-label="Exposure in stops"; }
            div.zoom role="group" aria-label="Zoom" {
                button type="button" data-zoom="out" aria-label="Zoom out" { "−" }
                button type="button" data-zoom="in" aria-label="Zoom in" { "+" }
                button type="button" data-zoom="fit" { "Fit" }
            }
        }
    }
}

/// What is compared at first: the first and the last contender of the longest equal time, else the
/// first picture and the reference.
fn first_choice(scene: &Scene<'_>, all: &[(String, &Shown)]) -> [String; 2] {
    let longest = scene.study.equal_time.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let contenders = longest.map(|row| row.entries.as_slice()).unwrap_or_default();
    let name = |(series, setting): &(String, usize)| {
        let series = scene.study.series.iter().position(|s| &s.name == series)?;
        let name = format!("{series}-{setting}");
        all.iter().any(|(known, _)| known == &name).then_some(name)
    };
    let names: Vec<String> = contenders.iter().filter_map(name).collect();
    match &names[..] {
        [first, .., last] => [first.clone(), last.clone()],
        _ => [all.len().min(2) - 1, 0].map(|i| all[i].0.clone()),
    }
}

fn key_list(id: &str) -> Markup {
    html! {
        details.key-list open { summary { "Keys" }
            dl id={(id) "-keys"} {
                @for (keys, what) in [
                    ("1, 2, 3", "show A, B, the reference"), ("Space", "flip between A and B"),
                    ("W, D, F", "wipe, signed difference A − B, FLIP of A to the reference"),
                    ("← →", "move the wipe; with Shift the picture"), ("↑ ↓", "move the picture"),
                    ("+ −, wheel, pinch", "zoom"), ("0", "fit"), ("[ ]", "exposure down, up by 1/4 stop"), ("Drag", "the line of the wipe, else the picture"),
                ] { div { dt { kbd { (keys) } } dd { (what) } } }
            }
        }
    }
}
