//! Is there a display, and which? Decided before the event loop is made, because a process can make only one.

use std::any::Any;

/// What the environment offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplayServer {
    /// Let the window library choose.
    Default,
    /// Wayland is announced but nobody listens, and X11 is there too.
    ForceX11,
    None,
}

/// Looks for a display.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn find() -> DisplayServer {
    use std::path::PathBuf;
    let var = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    // An absolute name counts as it is; `join` keeps it so.
    let wayland = var("WAYLAND_DISPLAY").map(|name| {
        let socket = PathBuf::from(var("XDG_RUNTIME_DIR").unwrap_or_default()).join(name);
        std::os::unix::net::UnixStream::connect(socket).is_ok()
    });
    // A socket handed over by the parent is open already.
    let wayland = if var("WAYLAND_SOCKET").is_some() { Some(true) } else { wayland };
    choose(wayland, var("DISPLAY").is_some())
}

/// Every other desktop has a display by being one.
#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn find() -> DisplayServer {
    DisplayServer::Default
}

/// From now on, panics over a lost display print nothing: who catches them tells people what happened.
///
/// The window library unwraps the answers of the X server, also in calls that cannot report an error.
pub(super) fn say_nothing_of_its_loss() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !is_loss(info.payload()) {
            usual(info);
        }
    }));
}

/// Is this what the window library panics with when the display's server no longer answers?
pub(super) fn is_loss(panic: &(dyn Any + Send)) -> bool {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    text.is_some_and(|text| {
        text.contains("an `Err` value: Connection(") || text.contains("an `Err` value: ConnectionError(")
    })
}

/// `wayland`: announced, and whether somebody listens; `x11`: announced.
#[cfg_attr(not(all(unix, not(target_os = "macos"))), allow(dead_code))]
fn choose(wayland: Option<bool>, x11: bool) -> DisplayServer {
    match (wayland, x11) {
        (Some(true), _) | (None, true) => DisplayServer::Default,
        // The window library would try Wayland alone and give up.
        (Some(false), true) => DisplayServer::ForceX11,
        (Some(false) | None, false) => DisplayServer::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_lost_connection_is_taken_for_one() {
        let lost = "called `Result::unwrap()` on an `Err` value: Connection(IoError(UnknownError))".to_owned();
        assert!(is_loss(&lost));
        assert!(!is_loss(&"index out of bounds"));
        assert!(!is_loss(&7));
    }

    #[test]
    fn a_dead_wayland_socket_leads_to_x11_or_to_none() {
        assert_eq!(choose(None, false), DisplayServer::None);
        assert_eq!(choose(None, true), DisplayServer::Default);
        assert_eq!(choose(Some(true), false), DisplayServer::Default);
        assert_eq!(choose(Some(true), true), DisplayServer::Default);
        assert_eq!(choose(Some(false), true), DisplayServer::ForceX11);
        assert_eq!(choose(Some(false), false), DisplayServer::None);
    }
}
