//! A file manager that drops one file: the source's side of XDND (freedesktop.org, version 5).

use super::until;
use std::path::Path;
use x11rb::connection::Connection as _;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConnectionExt as _, CreateWindowAux, EventMask, PropMode, SELECTION_NOTIFY_EVENT,
    SelectionNotifyEvent, SelectionRequestEvent, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;
use x11rb::{COPY_DEPTH_FROM_PARENT, COPY_FROM_PARENT, CURRENT_TIME};

/// Drops it on the middle of this window, and waits until the window has taken it.
pub fn drop_file(display: &str, target: u32, path: &Path) {
    let (connection, screen) = RustConnection::connect(Some(display)).expect("the display answers");
    let root = connection.setup().roots[screen].root;
    let atom = |name: &str| {
        let cookie = connection.intern_atom(false, name.as_bytes()).expect("the display answers");
        cookie.reply().expect("an atom").atom
    };
    let [selection, status, finished] = ["XdndSelection", "XdndStatus", "XdndFinished"].map(atom);
    let [enter, position, dropped] = ["XdndEnter", "XdndPosition", "XdndDrop"].map(atom);
    let [copy, uris] = ["XdndActionCopy", "text/uri-list"].map(atom);
    let source = connection.generate_id().expect("a number");
    let (class, aux) = (WindowClass::INPUT_ONLY, CreateWindowAux::new());
    let made = connection.create_window(0, source, root, 0, 0, 1, 1, 0, class, COPY_FROM_PARENT, &aux);
    assert_eq!(u32::from(COPY_DEPTH_FROM_PARENT), 0);
    made.expect("the display answers").check().expect("a window");
    connection.set_selection_owner(source, selection, CURRENT_TIME).expect("the display answers");
    let size = connection.get_geometry(target).expect("the display answers").reply().expect("the window is there");
    let corner = connection.translate_coordinates(target, root, 0, 0).expect("the display answers");
    let corner = corner.reply().expect("the window is on the screen");
    let (x, y) = (corner.dst_x as u32 + u32::from(size.width) / 2, corner.dst_y as u32 + u32::from(size.height) / 2);
    let send = |kind: u32, data: [u32; 5]| {
        let event = ClientMessageEvent::new(32, target, kind, data);
        connection.send_event(false, target, EventMask::NO_EVENT, event).expect("the display answers");
        connection.flush().expect("the display answers");
    };
    send(enter, [source, 5 << 24, uris, 0, 0]);
    send(position, [source, 0, x << 16 | y, CURRENT_TIME, copy]);
    let uri = format!("file://{}\r\n", path.display());
    let give = |request: SelectionRequestEvent| {
        let (mode, kind) = (PropMode::REPLACE, request.target);
        let (to, property) = (request.requestor, request.property);
        connection.change_property8(mode, to, property, kind, uri.as_bytes()).expect("the display answers");
        let notify = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: request.time,
            requestor: to,
            selection: request.selection,
            target: if kind == uris { kind } else { AtomEnum::NONE.into() },
            property,
        };
        connection.send_event(false, to, EventMask::NO_EVENT, notify).expect("the display answers");
        connection.flush().expect("the display answers");
    };
    let wait_for = |kind: u32, what: &str| {
        until(what, || match connection.poll_for_event().expect("the display answers")? {
            Event::SelectionRequest(request) => {
                give(request);
                None
            }
            Event::ClientMessage(message) if message.type_ == kind => Some(message.data.as_data32()),
            _ => None,
        })
    };
    let answer = wait_for(status, "the window to say whether it takes the file");
    assert_eq!(answer[1] & 1, 1, "it takes none");
    send(dropped, [source, 0, CURRENT_TIME, 0, 0]);
    wait_for(finished, "the window to take the file");
}
