//! The command line of claror.
//!
//! [`args`] is what was typed, [`config`] what it means; [`run`] holds the commands. [`messages`],
//! [`progress`], [`exit`] and [`signals`] are what the user meets on the way.

mod args;
mod bar;
mod bug;
mod config;
mod exit;
mod memory;
mod messages;
mod output;
mod parameters;
mod progress;
mod run;
mod signals;
mod units;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use args::{Cli, Command};
use config::Task;
use exit::{Exit, Failure};
use messages::{Console, Verbosity};

fn main() -> ExitCode {
    bug::install_hook();
    let arguments: Vec<OsString> = std::env::args_os().collect();
    std::panic::catch_unwind(|| start(&arguments)).unwrap_or(Exit::Bug).into()
}

fn start(arguments: &[OsString]) -> Exit {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return refuse(&error, arguments),
    };
    let verbosity = match (cli.common.quiet, cli.common.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Verbose,
        _ => Verbosity::Normal,
    };
    let mut console = Console::new(cli.common.json, verbosity);
    match dispatch(cli.command, &mut console) {
        Ok(exit) => console.finish(exit),
        Err(failure) => console.failure(&failure),
    }
}

fn dispatch(command: Command, console: &mut Console) -> Result<Exit, Failure> {
    match command {
        Command::Render(args) => return run::render::run(*args, Task::Render, console),
        Command::Verify(args) => return run::render::run(*args, Task::Verify, console),
        Command::Info(args) => return run::info::run(&args, console),
        Command::Check(args) => return run::check::run(&args, console),
        Command::Compare(args) => return run::compare::run(&args, console),
        Command::Bench(args) => return run::bench::run(&args, console),
        Command::Cache(command) => return run::cache::run(&command, console),
        Command::Completions(args) => run::documents::completions(&args, console),
        Command::Man(args) => run::documents::man(args, console),
        Command::Parameters(args) => run::documents::parameters(args, console),
    }
    Ok(Exit::Success)
}

/// Help and version go to standard output; anything else is a usage error.
fn refuse(error: &clap::Error, arguments: &[OsString]) -> Exit {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        // Nobody to tell if standard output is gone.
        let _ = error.print();
        return Exit::Success;
    }
    if arguments.iter().any(|argument| argument == "--json") {
        let console = Console::new(true, Verbosity::Normal);
        let text = error.render().to_string();
        let message = text.trim_start_matches("error: ").trim_end();
        console.failure(&Failure::usage(message));
    } else if messages::no_color() {
        let _ = write!(std::io::stderr(), "{}", error.render());
    } else {
        let _ = error.print();
    }
    Exit::Usage
}
