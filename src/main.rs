//! The program: parse, run, print the error and its hint, set the exit code.

/// glibc gives its heap back after every large tensor, which halves the speed.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    hybridsim::cli::main()
}
