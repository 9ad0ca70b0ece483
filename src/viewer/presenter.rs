//! Presents an image and the overlays on a window: the only file that uses pixels and wgpu.
//!
//! One graphics device serves both. The image has its place at the left of the window, beside the panel; where it has
//! another height, because the window has just been resized, it is stretched over it. Nothing here waits for rendering.

use crate::frame::Picture;
use pixels::{Pixels, PixelsBuilder, ScalingMode, SurfaceTexture, wgpu};
use std::sync::Arc;
use std::time::Duration;
use thiserror::Error;
use winit::event::WindowEvent;
use winit::window::Window;

/// Why nothing can be presented.
#[derive(Debug, Error)]
pub enum PresentError {
    #[error(
        "no usable graphics driver ({0}); install one (on Debian or Ubuntu: mesa-vulkan-drivers), or render without a window: firstlight render SCENE -o out.png"
    )]
    NoDriver(pixels::Error),
    #[error("cannot draw the window: {0}")]
    Failed(#[from] pixels::Error),
    #[error("cannot draw the window: {0}")]
    Texture(#[from] pixels::TextureError),
}

/// Result of presenting a frame.
#[derive(Clone, Copy, Debug)]
pub struct Presented {
    /// When the overlays are to be repainted; `Duration::MAX` for never.
    pub repaint_after: Duration,
    /// The window was not ready; draw again at the next opportunity.
    pub again: bool,
}

pub struct Presenter {
    // Dropped in this order: everything on the device before the window.
    egui_renderer: egui_wgpu::Renderer,
    egui_state: egui_winit::State,
    pixels: Pixels<'static>,
    surface_size: (u32, u32),
    buffer_size: (u32, u32),
    window: Arc<Window>,
}

impl Presenter {
    pub fn new(window: Arc<Window>) -> Result<Self, PresentError> {
        let size = window.inner_size();
        let (width, height) = (size.width.max(1), size.height.max(1));
        let surface = SurfaceTexture::new(width, height, window.clone());
        let no_driver = |error| match error {
            pixels::Error::AdapterNotFound | pixels::Error::CreateSurface(_) | pixels::Error::DeviceNotFound(_) => {
                PresentError::NoDriver(error)
            }
            other => PresentError::Failed(other),
        };
        // The bytes are display values already, and overlays are blended as bytes: no conversions, which a software
        // renderer would have to do for every pixel. The image is opaque.
        let mut pixels = PixelsBuilder::new(width, height, surface)
            .texture_format(wgpu::TextureFormat::Rgba8Unorm)
            .surface_texture_format(wgpu::TextureFormat::Bgra8Unorm)
            .blend_state(wgpu::BlendState::REPLACE)
            .build()
            .map_err(no_driver)?;
        let modes = &pixels.context().surface_capabilities.present_modes;
        let can = |mode| modes.contains(&mode);
        // Waiting for vertical sync would delay the next input. The scheduler produces images hardly faster than the
        // display rate, so few are replaced before they are shown.
        let best = [wgpu::PresentMode::Mailbox, wgpu::PresentMode::Immediate].into_iter().find(|&mode| can(mode));
        if let Some(mode) = best {
            pixels.set_present_mode(mode);
        }
        // The default handler panics; a failed frame is followed by another.
        pixels.device().on_uncaptured_error(Arc::new(|error| log::error!("graphics: {error}")));
        let egui_state = egui_winit::State::new(
            egui::Context::default(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(pixels.device().limits().max_texture_dimension_2d as usize),
        );
        let egui_renderer =
            egui_wgpu::Renderer::new(pixels.device(), pixels.surface_texture_format(), Default::default());
        let size = (width, height);
        let mut presenter = Self { egui_renderer, egui_state, pixels, surface_size: size, buffer_size: size, window };
        presenter.fit_buffer()?;
        Ok(presenter)
    }

    pub fn egui_context(&self) -> &egui::Context {
        self.egui_state.egui_ctx()
    }

    /// Physical pixels per point, the unit of overlays.
    pub fn pixels_per_point(&self) -> f32 {
        self.egui_state.egui_ctx().pixels_per_point()
    }

    /// The largest side of an image that can be shown.
    pub fn max_side(&self) -> u32 {
        self.pixels.device().limits().max_texture_dimension_2d
    }

    /// Passes an event to the overlays; returns whether they consumed it, and whether they need a repaint.
    pub fn on_window_event(&mut self, event: &WindowEvent) -> egui_winit::EventResponse {
        self.egui_state.on_window_event(&self.window, event)
    }

    /// Sets the image to show.
    ///
    /// - `free`: width of its place in the window, physical pixels: one of another width is centred there.
    pub fn set_picture(&mut self, picture: &Picture, free: u32) -> Result<(), PresentError> {
        let (width, height) = (picture.width, picture.height);
        if width == 0 || height == 0 || picture.rgba.len() != width as usize * height as usize * 4 {
            return Ok(());
        }
        self.fit_surface()?;
        let is_in_place = height == self.surface_size.1;
        let size = if is_in_place { self.surface_size } else { (width, height) };
        if size != self.buffer_size {
            self.pixels.resize_buffer(size.0, size.1)?;
            self.buffer_size = size;
            self.fit_buffer()?;
        }
        let free = if is_in_place { free.min(size.0) } else { width };
        copy_centred(&picture.rgba, width as usize, self.pixels.frame_mut(), size.0 as usize, free as usize);
        Ok(())
    }

    /// Follows the size of the window; returns false for one without pixels.
    fn fit_surface(&mut self) -> Result<bool, PresentError> {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            return Ok(false);
        }
        let surface_size = (size.width.min(self.max_side()), size.height.min(self.max_side()));
        if self.surface_size != surface_size {
            self.surface_size = surface_size;
            self.fit_buffer()?;
        }
        Ok(true)
    }

    /// Fits the buffer to the window; at equal sizes without scaling, which is cheaper.
    fn fit_buffer(&mut self) -> Result<(), PresentError> {
        let (width, height) = self.surface_size;
        let is_as_large = self.buffer_size == self.surface_size;
        self.pixels.set_scaling_mode(if is_as_large { ScalingMode::PixelPerfect } else { ScalingMode::Fill });
        // The position of the image depends on the mode and is recomputed by this call.
        Ok(self.pixels.resize_surface(width, height)?)
    }

    /// Draws the image with `overlays` over it. Does nothing for a window without pixels.
    pub fn present(&mut self, overlays: impl FnMut(&egui::Context)) -> Result<Presented, PresentError> {
        let context = self.egui_state.egui_ctx().clone();
        let output = context.run(self.egui_state.take_egui_input(&self.window), overlays);
        self.egui_state.handle_platform_output(&self.window, output.platform_output);
        let (device, queue) = (self.pixels.device(), self.pixels.queue());
        // Textures are reported only once, so they are updated even if this frame is not shown.
        for (id, delta) in &output.textures_delta.set {
            self.egui_renderer.update_texture(device, queue, *id, delta);
        }
        let jobs = context.tessellate(output.shapes, output.pixels_per_point);
        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        let repaint_after = root.map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        let shown = self.draw(&jobs, output.pixels_per_point);
        for id in &output.textures_delta.free {
            self.egui_renderer.free_texture(id);
        }
        Ok(Presented { repaint_after, again: !shown? })
    }

    /// Draws; returns false if the surface was not ready.
    fn draw(&mut self, jobs: &[egui::ClippedPrimitive], pixels_per_point: f32) -> Result<bool, PresentError> {
        if !self.fit_surface()? {
            return Ok(true);
        }
        // Uses the surface's own size: the window's may be newer already.
        let (width, height) = self.surface_size;
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point };
        let (egui_renderer, window) = (&mut self.egui_renderer, &self.window);
        let result = self.pixels.render_with(|encoder, view, context| {
            context.scaling_renderer.render(encoder, view);
            let commands = egui_renderer.update_buffers(&context.device, &context.queue, encoder, jobs, &screen);
            context.queue.submit(commands);
            let mut pass = encoder
                .begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("overlays"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view,
                        depth_slice: None,
                        resolve_target: None,
                        ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
                    })],
                    ..Default::default()
                })
                .forget_lifetime();
            egui_renderer.render(&mut pass, jobs, &screen);
            window.pre_present_notify();
            Ok(())
        });
        match result {
            Ok(()) => Ok(true),
            Err(pixels::Error::Surface(
                wgpu::SurfaceError::Timeout | wgpu::SurfaceError::Outdated | wgpu::SurfaceError::Lost,
            )) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

/// Copies an image to the middle of the first `free` pixels of wider or narrower rows; what it does not reach repeats its
/// edges, so that the bar over all of the window shows no seam.
///
/// - `from`, `to`: pixels of four bytes, in rows of `width` and `to_width` pixels; as many rows in both.
fn copy_centred(from: &[u8], width: usize, to: &mut [u8], to_width: usize, free: usize) {
    if (free, to_width) == (width, width) {
        return to.copy_from_slice(from);
    }
    let (left, skipped) = (free.saturating_sub(width) / 2, width.saturating_sub(free) / 2);
    let shown = width.min(free);
    let rows = from.chunks_exact(4 * width).zip(to.chunks_exact_mut(4 * to_width));
    for (from, to) in rows {
        let (from, to) = (from.as_chunks::<4>().0, to.as_chunks_mut::<4>().0);
        to[..left].fill(from[0]);
        to[left..left + shown].copy_from_slice(&from[skipped..skipped + shown]);
        to[left + shown..].fill(from[width - 1]);
    }
}

#[cfg(test)]
mod tests {
    use super::copy_centred;

    #[test]
    fn an_image_is_centred_in_what_the_panel_leaves_free() {
        let pixels = |numbers: &[u8]| numbers.iter().flat_map(|n| [*n; 4]).collect::<Vec<u8>>();
        let image = pixels(&[1, 2, 3, 4, 5, 6]);
        let placed = |to_width: usize, free| {
            let mut to = vec![9; 4 * 2 * to_width];
            copy_centred(&image, 3, &mut to, to_width, free);
            to
        };
        assert_eq!(placed(3, 3), image);
        assert_eq!(placed(5, 3), pixels(&[1, 2, 3, 3, 3, 4, 5, 6, 6, 6]), "the panel is open");
        assert_eq!(placed(3, 1), pixels(&[2, 3, 3, 5, 6, 6]), "it has just been opened");
        assert_eq!(placed(5, 5), pixels(&[1, 1, 2, 3, 3, 4, 4, 5, 6, 6]), "or closed");
    }
}
