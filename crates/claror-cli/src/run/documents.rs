//! `claror completions`, `claror man` and `claror parameters`: what is made from the definition of the
//! options and the tables of parameters.

use std::io::{self, Write};

use clap::CommandFactory;
use clap_mangen::Man;
use clap_mangen::roff::{Inline, Roff, roman};

use crate::args::{Cli, CompletionsArgs, MarkdownArgs};
use crate::messages::Console;
use crate::parameters::reference;

/// Writes the completion script of a shell.
pub(crate) fn completions(args: &CompletionsArgs, console: &Console) {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "claror", &mut script);
    console.stdout.write(&script);
}

/// Writes all parameters.
pub(crate) fn parameters(args: MarkdownArgs, console: &Console) {
    let page = if args.markdown { reference::markdown() } else { reference::text() };
    console.stdout.write(page.as_bytes());
}

/// Writes the manual page: all commands on one page.
pub(crate) fn man(args: MarkdownArgs, console: &Console) {
    if args.markdown {
        return console.stdout.write(super::command_line::markdown().as_bytes());
    }
    let mut page = Vec::new();
    render_page(&mut page).expect("writing to memory does not fail");
    console.stdout.write(&page);
}

fn render_page(page: &mut Vec<u8>) -> io::Result<()> {
    let mut command = Cli::command();
    command.build();
    let man = Man::new(command.clone()).manual("User commands");
    man.render_title(page)?;
    man.render_name_section(page)?;
    man.render_synopsis_section(page)?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    render_commands(page, "claror", &command)?;
    render_text(page, "EXIT STATUS", &exit_codes())?;
    render_text(page, "ENVIRONMENT", ENVIRONMENT)
}

/// The commands below one that is called `parent`, each before its own.
fn render_commands(page: &mut Vec<u8>, parent: &str, command: &clap::Command) -> io::Result<()> {
    for subcommand in command.get_subcommands().filter(|c| c.get_name() != "help") {
        let name = format!("{parent} {}", subcommand.get_name());
        render_command(page, &name, subcommand)?;
        render_commands(page, &name, subcommand)?;
    }
    Ok(())
}

/// A section for a command: usage, what it does, its options and notes.
fn render_command(page: &mut Vec<u8>, name: &str, command: &clap::Command) -> io::Result<()> {
    let title = name.to_uppercase();
    let usage = command.clone().render_usage().to_string();
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    render_text(page, &title, &format!("{about}.\n\n{usage}"))?;

    let mut options = Vec::new();
    // What all commands share is described once.
    let own = command.clone().mut_args(|arg| {
        let shared = arg.is_global_set() || arg.get_id() == "help";
        arg.hide(shared)
    });
    Man::new(own).render_options_section(&mut options)?;
    let options = String::from_utf8_lossy(&options);
    // The options stand under the command's own heading.
    page.write_all(options.replace(".SH ", ".SS ").as_bytes())?;
    match command.get_after_help() {
        Some(notes) => render_lines(page, &notes.to_string()),
        None => Ok(()),
    }
}

fn render_text(page: &mut Vec<u8>, title: &str, text: &str) -> io::Result<()> {
    let mut roff = Roff::new();
    roff.control("SH", [title]);
    page.write_all(roff.to_roff().as_bytes())?;
    render_lines(page, text)
}

/// Text whose lines stay lines.
fn render_lines(page: &mut Vec<u8>, text: &str) -> io::Result<()> {
    let mut roff = Roff::new();
    roff.control("PP", []).control("nf", []);
    for line in text.lines() {
        let inlines: [Inline; 1] = [roman(line)];
        roff.text(inlines);
    }
    roff.control("fi", []);
    page.write_all(roff.to_roff().as_bytes())
}

fn exit_codes() -> String {
    crate::exit::TABLE.lines().skip(1).map(|line| format!("{}\n", line.trim_start())).collect()
}

pub(super) const ENVIRONMENT: &str = "\
CLAROR_THREADS     threads to use, as --threads
CLAROR_MAX_MEMORY  memory not to exceed, as --max-memory
NO_COLOR           no colour, if set and not empty
TERM               `dumb` shows progress in plain lines";
