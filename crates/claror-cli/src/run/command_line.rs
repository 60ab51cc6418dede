//! The page about all commands and options, made from their definition.

use clap::{Arg, Command, CommandFactory};

use super::documents::ENVIRONMENT;
use crate::args::Cli;

const INTRODUCTION: &str = "\
# Command line

<!-- Written by `claror man --markdown`. Do not edit: change the options in the code. -->

`claror help COMMAND` shows the same in a terminal, `claror completions SHELL` lets a shell complete it.
";

/// The page in Markdown: every command with its options, then what all share.
pub(crate) fn markdown() -> String {
    let mut command = Cli::command();
    command.build();
    let mut page = INTRODUCTION.to_owned();
    commands(&mut page, "claror", &command);
    page += "\n## All commands\n";
    let shared: Vec<&Arg> = command.get_arguments().filter(|arg| arg.is_global_set()).collect();
    options(&mut page, &shared);
    page += &format!("\n## Exit codes and environment\n\n```text\n{}\n\n", crate::exit::TABLE);
    page += &format!("Environment:\n{}\n```\n", indented(ENVIRONMENT, "  "));
    page
}

/// The commands below one that is called `parent`, each before its own.
fn commands(page: &mut String, parent: &str, command: &Command) {
    for subcommand in command.get_subcommands().filter(|c| c.get_name() != "help") {
        let name = format!("{parent} {}", subcommand.get_name());
        one_command(page, &name, subcommand);
        commands(page, &name, subcommand);
    }
}

fn one_command(page: &mut String, name: &str, command: &Command) {
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    *page += &format!("\n## `{name}`\n\n{about}.\n\n```text\n{usage}\n```\n");
    if name == "claror verify" {
        *page += "\nIts options are those of `claror render`, above.\n";
    } else {
        let own = |arg: &&Arg| !arg.is_global_set() && !matches!(arg.get_id().as_str(), "help");
        let own: Vec<&Arg> = command.get_arguments().filter(own).collect();
        // Options without a heading come first, as in the terminal.
        let mut headings: Vec<Option<&str>> = vec![None];
        for arg in &own {
            let heading = arg.get_help_heading();
            if !headings.contains(&heading) {
                headings.push(heading);
            }
        }
        for heading in headings {
            let below: Vec<&Arg> =
                own.iter().copied().filter(|arg| arg.get_help_heading() == heading).collect();
            if let (Some(heading), false) = (heading, below.is_empty()) {
                *page += &format!("\n**{heading}**\n");
            }
            options(page, &below);
        }
    }
    if let Some(notes) = command.get_after_help() {
        *page += &format!("\n```text\n{}\n```\n", notes.to_string().trim());
    }
}

/// A list of options, nothing if there are none.
fn options(page: &mut String, arguments: &[&Arg]) {
    if !arguments.is_empty() {
        page.push('\n');
    }
    for arg in arguments {
        *page += &format!("- `{}`: {}", spelling(arg), meaning(arg));
        let extras = extras(arg);
        if !extras.is_empty() {
            *page += &format!(" ({})", extras.join("; "));
        }
        page.push('\n');
        let values = arg.get_possible_values();
        for value in values.iter().filter(|value| value.get_help().is_some()) {
            let help = value.get_help().map(|help| escape(&help.to_string())).unwrap_or_default();
            *page += &format!("  - `{}`: {help}\n", value.get_name());
        }
    }
}

/// How it is typed.
fn spelling(arg: &Arg) -> String {
    let long = arg.get_long().map(|long| format!("--{long}"));
    let short = arg.get_short().map(|short| format!("-{short}"));
    let names: Vec<String> = short.into_iter().chain(long).collect();
    let value = arg.get_value_names().and_then(|names| names.first()).map(|name| name.as_str());
    let value = value.filter(|_| arg.get_action().takes_values()).unwrap_or_default();
    if names.is_empty() {
        return value.to_owned();
    }
    let typed = names.join(", ");
    match (value, arg.is_require_equals_set()) {
        ("", _) => typed,
        (value, true) => format!("{typed}[={value}]"),
        (value, false) => format!("{typed} {value}"),
    }
}

/// The help in one paragraph. What `-p` sets has a page of its own.
fn meaning(arg: &Arg) -> String {
    let short = arg.get_help().map(ToString::to_string).unwrap_or_default();
    if arg.get_id() == "parameters" {
        return format!("{}; [all parameters](parameters.md)", escape(&short));
    }
    let long = arg.get_long_help().map_or(short, ToString::to_string);
    let mut text = String::new();
    for paragraph in long.split("\n\n").map(str::trim).filter(|p| !p.is_empty()) {
        if !text.is_empty() {
            text += if text.ends_with(['.', ':']) { " " } else { ". " };
        }
        text += &paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    }
    escape(&text)
}

/// Default, values without explanation, variable of the environment.
fn extras(arg: &Arg) -> Vec<String> {
    let mut extras = Vec::new();
    if arg.get_action().takes_values() {
        let defaults = arg.get_default_values().iter();
        let defaults: Vec<String> = defaults.map(|v| format!("`{}`", v.display())).collect();
        if !defaults.is_empty() {
            extras.push(format!("default {}", defaults.join(", ")));
        }
        let values = arg.get_possible_values();
        if !values.is_empty() && values.iter().all(|value| value.get_help().is_none()) {
            let names: Vec<String> =
                values.iter().map(|value| format!("`{}`", value.get_name())).collect();
            extras.push(format!("one of {}", names.join(", ")));
        }
    }
    if let Some(variable) = arg.get_env() {
        extras.push(format!("environment `{}`", variable.display()));
    }
    extras
}

/// What Markdown would take for its own.
fn escape(text: &str) -> String {
    text.replace('<', "\\<").replace('[', "\\[").replace('|', "\\|").replace('*', "\\*")
}

fn indented(text: &str, by: &str) -> String {
    text.lines().map(|line| format!("{by}{line}")).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_and_option_is_on_the_page() {
        let page = markdown();
        let render = Cli::command();
        let render = render.find_subcommand("render").expect("it exists");
        for arg in render.get_arguments().filter(|arg| arg.get_long().is_some()) {
            let long = arg.get_long().unwrap_or_default();
            assert!(page.contains(&format!("--{long}")), "{long}");
        }
        for heading in ["render", "verify", "cache info", "cache export", "man", "parameters"] {
            assert!(page.contains(&format!("\n## `claror {heading}`\n")), "{heading}");
        }
    }
}
