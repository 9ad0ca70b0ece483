//! What another program gets from the clipboard: the requestor's side of a selection (ICCCM, section 2.4).

use super::until;
use x11rb::connection::Connection as _;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{AtomEnum, ConnectionExt as _, CreateWindowAux, WindowClass};
use x11rb::rust_connection::RustConnection;
use x11rb::{COPY_FROM_PARENT, CURRENT_TIME, NONE};

/// The text on the clipboard, empty if there is none.
pub fn text(display: &str) -> String {
    let (connection, screen) = RustConnection::connect(Some(display)).expect("the display answers");
    let root = connection.setup().roots[screen].root;
    let atom = |name: &str| {
        let cookie = connection.intern_atom(false, name.as_bytes()).expect("the display answers");
        cookie.reply().expect("an atom").atom
    };
    let [clipboard, utf8, property] = ["CLIPBOARD", "UTF8_STRING", "FIRSTLIGHT_TEST"].map(atom);
    let window = connection.generate_id().expect("a number");
    let (class, aux) = (WindowClass::INPUT_ONLY, CreateWindowAux::new());
    let made = connection.create_window(0, window, root, 0, 0, 1, 1, 0, class, COPY_FROM_PARENT, &aux);
    made.expect("the display answers").check().expect("a window");
    let asked = connection.convert_selection(window, clipboard, utf8, property, CURRENT_TIME);
    asked.expect("the display answers").check().expect("a selection");
    let given = until("the clipboard to answer", || match connection.poll_for_event() {
        Ok(Some(Event::SelectionNotify(notify))) => Some(notify.property),
        _ => None,
    });
    if given == NONE {
        return String::new();
    }
    let read = connection.get_property(true, window, property, AtomEnum::ANY, 0, 1 << 16);
    let value = read.expect("the display answers").reply().expect("the property is there").value;
    String::from_utf8(value).expect("UTF-8")
}
