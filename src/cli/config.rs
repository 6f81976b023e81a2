//! `kreisel config`: the complete configuration, to be edited and fed back.

use std::io::Write as _;

use anyhow::Result;
use clap::{Args, ValueEnum};

use super::Completion;
use crate::config::{Configuration, text};
use crate::parameter::Profile;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Profile to print.
    #[arg(long, value_name = "NAME", value_enum, default_value = "default")]
    profile: ProfileName,
}

/// Profiles on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum ProfileName {
    /// The best that has been measured.
    Default,
    /// The thesis' algorithm with the thesis' numbers.
    Thesis,
}

pub(super) fn run(arguments: &Arguments) -> Result<Completion> {
    let profile = match arguments.profile {
        ProfileName::Default => Profile::Default,
        ProfileName::Thesis => Profile::Thesis,
    };
    let printed = text::print(&Configuration::profile(profile));
    std::io::stdout().write_all(printed.as_bytes())?;
    Ok(Completion::Done)
}
