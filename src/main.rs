//! The program: parse, run, print the error and its hint, set the exit code.

/// glibc gives its heap back after every large tensor, which halves the speed.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Graphics libraries complain on standard error when they look for adapters without it.
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    hybridsim::cli::main()
}
