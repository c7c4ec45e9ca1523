//! The command `planish`.

use clap::Parser;
use planish::cli::{Cli, Verb};
use planish::operating::logging;
use planish::settings::Settings;
use planish::verbs::{self, Exit};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let ended = cli.verb.settings().map_err(Into::into).and_then(|settings| {
        let _until_the_end = logging::start(&settings, matches!(cli.verb, Verb::Watch(_)));
        dispatch(&cli.verb, &settings)
    });
    ended
        .unwrap_or_else(|error| {
            verbs::eprint_line(&error.to_string());
            Exit::Usage
        })
        .into()
}

fn dispatch(verb: &Verb, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    match verb {
        Verb::Run(run) => verbs::run::run(&run.inputs, settings),
        Verb::Watch(watch) => verbs::watch::watch(watch, settings, &|| verb.settings()),
        Verb::Check(check) => match verbs::check_mesh::Question::of(check) {
            Some(question) => verbs::check_mesh::check_mesh(&check.results, &question, settings),
            None => Ok(verbs::check::check(&check.results, settings.quiet)),
        },
        Verb::Info(info) => verbs::info::info(&info.inputs, info.json, settings),
        Verb::Lift(lift) => verbs::lift::lift(lift, settings),
        Verb::Transfer(transfer) => verbs::transfer::transfer(transfer, settings),
        Verb::Apart(apart) => verbs::job::job(apart, settings),
        Verb::Status(status) => verbs::status::status(status, settings),
        Verb::Retry(retry) => verbs::retry::retry(&retry.names, settings),
    }
}
