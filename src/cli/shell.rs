//! `hybridsim completions` and `hybridsim man`: what shells and `man` want to know, out of the definition of the verbs.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::Cli;
use crate::{
    data::atomic::write_file,
    error::{Error, Result},
};

#[derive(Args)]
pub(crate) struct Completions {
    /// Shell that reads them
    shell: Shell,
}

#[derive(Args)]
pub(crate) struct Man {
    /// Folder for a page a verb
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn completions(arguments: &Completions) -> Result<()> {
    let mut text = vec![];
    clap_complete::generate(arguments.shell, &mut Cli::command(), "hybridsim", &mut text);
    say!("{}", String::from_utf8_lossy(&text).trim_end());
    Ok(())
}

pub(crate) fn man(arguments: &Man) -> Result<()> {
    std::fs::create_dir_all(&arguments.out).map_err(|source| Error::write(&arguments.out, source))?;
    let mut program = Cli::command();
    program.build();
    let mut commands = vec![program];
    while let Some(command) = commands.pop() {
        commands.extend(command.get_subcommands().filter(|verb| verb.get_name() != "help").cloned());
        let page = clap_mangen::Man::new(command);
        write_file(arguments.out.join(page.get_filename()), |file| page.render(file))?;
    }
    say!("man pages: {}", arguments.out.display());
    Ok(())
}
