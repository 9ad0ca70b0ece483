//! A session in a window of one's own: `cargo run --release --example own_window -- cornell`.
//!
//! Arrow keys orbit, Escape closes. The session renders on threads of its own; `update` never waits for them.

use firstlight::prelude::*;
use pixels::{Pixels, SurfaceTexture};
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

const SIZE: (u32, u32) = (640, 480);

struct App {
    session: Session,
    start: Instant,
    /// `None` before the window is there.
    screen: Option<(Arc<Window>, Pixels<'static>)>,
}

impl App {
    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Box<dyn Error>> {
        let window = Arc::new(event_loop.create_window(Window::default_attributes().with_title("own window"))?);
        let size = window.inner_size();
        let surface = SurfaceTexture::new(size.width.max(1), size.height.max(1), window.clone());
        self.screen = Some((window, Pixels::new(SIZE.0, SIZE.1, surface)?));
        Ok(())
    }

    fn key(&mut self, key: &Key, event_loop: &ActiveEventLoop) {
        let orbit = |yaw_deg, pitch_deg| Command::Orbit { yaw_deg, pitch_deg };
        match key {
            Key::Named(NamedKey::ArrowLeft) => self.session.send(orbit(-5.0, 0.0)),
            Key::Named(NamedKey::ArrowRight) => self.session.send(orbit(5.0, 0.0)),
            Key::Named(NamedKey::ArrowUp) => self.session.send(orbit(0.0, 5.0)),
            Key::Named(NamedKey::ArrowDown) => self.session.send(orbit(0.0, -5.0)),
            Key::Named(NamedKey::Escape) => event_loop.exit(),
            _ => {}
        }
    }

    fn draw(&mut self) -> Result<(), Box<dyn Error>> {
        self.session.update(self.start.elapsed());
        let Some((window, screen)) = &mut self.screen else { return Ok(()) };
        let picture = self.session.picture();
        if !picture.rgba.is_empty() {
            // While the camera moves, the picture is coarser than the window.
            let texture = screen.texture();
            if (texture.width(), texture.height()) != (picture.width, picture.height) {
                screen.resize_buffer(picture.width, picture.height)?;
            }
            screen.frame_mut().copy_from_slice(&picture.rgba);
        }
        window.pre_present_notify();
        screen.render()?;
        Ok(())
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Err(error) = self.open_window(event_loop) {
            eprintln!("{error}");
            event_loop.exit();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Some((_, screen)) = &mut self.screen
                    && let Err(error) = screen.resize_surface(size.width.max(1), size.height.max(1))
                {
                    eprintln!("{error}");
                }
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                self.key(&event.logical_key, event_loop);
            }
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw() {
                    eprintln!("{error}");
                    event_loop.exit();
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + Duration::from_millis(15)));
        if let Some((window, _)) = &self.screen {
            window.request_redraw();
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let scene = std::env::args().nth(1).unwrap_or_else(|| "cornell".to_owned());
    // `yielding`: the workers give way to the thread that draws.
    let options = SessionOptions { width: SIZE.0, height: SIZE.1, yielding: true, ..SessionOptions::default() };
    let mut session = Session::new(options)?;
    session.open(SceneSource::parse(scene)?);
    let mut app = App { session, start: Instant::now(), screen: None };
    EventLoop::new()?.run_app(&mut app)?;
    Ok(())
}
