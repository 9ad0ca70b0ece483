//! A desktop's settings, by which a person makes everything on the screen larger: the manager's side of XSETTINGS
//! (freedesktop.org, version 0.5).

use x11rb::connection::Connection as _;
use x11rb::protocol::xproto::{ConnectionExt as _, CreateWindowAux, PropMode, WindowClass};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;
use x11rb::{COPY_FROM_PARENT, CURRENT_TIME};

/// As long as it lives, programs ask it for the scale.
pub struct Scale {
    connection: RustConnection,
    window: u32,
}

impl Scale {
    pub fn new(display: &str) -> Self {
        let (connection, screen) = RustConnection::connect(Some(display)).expect("the display answers");
        let root = connection.setup().roots[screen].root;
        let window = connection.generate_id().expect("a number");
        let (class, aux) = (WindowClass::INPUT_ONLY, CreateWindowAux::new());
        let made = connection.create_window(0, window, root, 0, 0, 1, 1, 0, class, COPY_FROM_PARENT, &aux);
        made.expect("the display answers").check().expect("a window");
        let scale = Self { connection, window };
        scale.set_dpi(96);
        let manager = scale.atom(&format!("_XSETTINGS_S{screen}"));
        scale.connection.set_selection_owner(window, manager, CURRENT_TIME).expect("the display answers");
        scale.wait();
        scale
    }

    /// Dots an inch of the whole display; 96 is scale 1.
    pub fn set_dpi(&self, dpi: i32) {
        const NAME: &[u8; 7] = b"Xft/DPI";
        let mut settings = vec![u8::from(cfg!(target_endian = "big")), 0, 0, 0];
        // A serial number, and that there is one setting: a whole number (0) with a name, padded to four bytes.
        settings.extend([1_u32, 1].iter().flat_map(|number| number.to_ne_bytes()));
        settings.extend([0, 0].into_iter().chain((NAME.len() as u16).to_ne_bytes()).chain(*NAME).chain([0]));
        settings.extend(1_u32.to_ne_bytes().into_iter().chain((1024 * dpi).to_ne_bytes()));
        let kind = self.atom("_XSETTINGS_SETTINGS");
        let set = self.connection.change_property8(PropMode::REPLACE, self.window, kind, kind, &settings);
        set.expect("the display answers").check().expect("the settings are set");
    }

    fn atom(&self, name: &str) -> u32 {
        let cookie = self.connection.intern_atom(false, name.as_bytes()).expect("the display answers");
        cookie.reply().expect("an atom").atom
    }

    /// Until the server has carried out what it was asked for.
    fn wait(&self) {
        self.connection.get_input_focus().expect("the display answers").reply().expect("an answer");
    }
}
