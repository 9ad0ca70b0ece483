//! Presents an image and the overlays on a window: the only file that uses pixels and wgpu.
//!
//! One graphics device serves both. The image and the window have separate sizes; the image is stretched over the
//! window, so a coarse image shown while moving fills it too. Nothing here waits for rendering.

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
    picture_size: (u32, u32),
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
        let mut presenter = Self { egui_renderer, egui_state, pixels, surface_size: size, picture_size: size, window };
        presenter.fit_picture()?;
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
    /// - `aside`: how far it is moved to the left, pixels.
    pub fn set_picture(&mut self, picture: &Picture, aside: u32) -> Result<(), PresentError> {
        let size = (picture.width, picture.height);
        if size.0 == 0 || size.1 == 0 || picture.rgba.len() != size.0 as usize * size.1 as usize * 4 {
            return Ok(());
        }
        if size != self.picture_size {
            self.pixels.resize_buffer(size.0, size.1)?;
            self.picture_size = size;
            self.fit_picture()?;
        }
        copy_aside(&picture.rgba, self.pixels.frame_mut(), size.0, aside);
        Ok(())
    }

    /// Fits the image to the window; at equal sizes without scaling, which is cheaper.
    fn fit_picture(&mut self) -> Result<(), PresentError> {
        let (width, height) = self.surface_size;
        let is_as_large = self.picture_size == self.surface_size;
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
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            return Ok(true);
        }
        let surface_size = (size.width.min(self.max_side()), size.height.min(self.max_side()));
        if self.surface_size != surface_size {
            self.surface_size = surface_size;
            self.fit_picture()?;
        }
        // Uses the surface's own size: the window's may be newer already.
        let screen = egui_wgpu::ScreenDescriptor { size_in_pixels: [surface_size.0, surface_size.1], pixels_per_point };
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

/// Copies an image, moved to the left by `aside` pixels; what is uncovered at the right repeats its edge, so that the bar
/// shows no seam.
///
/// - `width`: of both, pixels of four bytes.
fn copy_aside(from: &[u8], to: &mut [u8], width: u32, aside: u32) {
    let aside = aside.min(width.saturating_sub(1));
    if aside == 0 {
        return to.copy_from_slice(from);
    }
    let (row, left) = (4 * width as usize, 4 * aside as usize);
    for (from, to) in from.chunks_exact(row).zip(to.chunks_exact_mut(row)) {
        let (shown, uncovered) = to.split_at_mut(row - left);
        shown.copy_from_slice(&from[left..]);
        uncovered.as_chunks_mut::<4>().0.fill(from[row - 4..].try_into().expect("a pixel has four bytes"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_moves_to_the_left_by_whole_pixels() {
        let image: Vec<u8> = (0..24).collect();
        let moved = |aside| {
            let mut to = vec![9; 24];
            copy_aside(&image, &mut to, 3, aside);
            to
        };
        assert_eq!(moved(0), image);
        assert_eq!(moved(1), [&image[4..12], &image[8..12], &image[16..24], &image[20..24]].concat());
        assert_eq!(moved(7), [image[8..12].repeat(3), image[20..24].repeat(3)].concat());
    }
}
