//! Detection of the display server, before the event loop is created, because a process can create only one.

use std::any::Any;

/// The display server to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DisplayServer {
    /// Let the window library choose.
    Default,
    /// Wayland is announced but does not respond, and X11 is available.
    ForceX11,
    None,
}

/// Detects the display server.
#[cfg(all(unix, not(target_os = "macos")))]
pub fn find() -> DisplayServer {
    use std::path::PathBuf;
    let var = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    // If the name is absolute, `join` returns it unchanged.
    let wayland = var("WAYLAND_DISPLAY").map(|name| {
        let socket = PathBuf::from(var("XDG_RUNTIME_DIR").unwrap_or_default()).join(name);
        std::os::unix::net::UnixStream::connect(socket).is_ok()
    });
    // A socket inherited from the parent is already open.
    let wayland = if var("WAYLAND_SOCKET").is_some() { Some(true) } else { wayland };
    choose(wayland, var("DISPLAY").is_some())
}

/// Other desktops always have a display.
#[cfg(not(all(unix, not(target_os = "macos"))))]
pub fn find() -> DisplayServer {
    DisplayServer::Default
}

/// Silences panics over a lost display; the code that catches them reports the error.
///
/// The window library unwraps the replies of the X server, also in calls that cannot return an error.
pub(super) fn silence_loss_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !is_loss(info.payload()) {
            usual(info);
        }
    }));
}

/// Whether this is a panic of the window library after the display server stopped responding.
pub(super) fn is_loss(panic: &(dyn Any + Send)) -> bool {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    text.is_some_and(|text| {
        text.contains("an `Err` value: Connection(") || text.contains("an `Err` value: ConnectionError(")
    })
}

/// Chooses a server. `wayland`: if announced, whether it responds; `x11`: whether it is announced.
#[cfg_attr(not(all(unix, not(target_os = "macos"))), allow(dead_code))]
fn choose(wayland: Option<bool>, x11: bool) -> DisplayServer {
    match (wayland, x11) {
        (Some(true), _) | (None, true) => DisplayServer::Default,
        // The window library would only try Wayland and give up.
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
