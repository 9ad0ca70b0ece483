//! Accumulated input between two frames.

use crate::frame::{Command, Edit};

/// Movement not yet sent, and the commands that must follow it in order.
#[derive(Debug, Default)]
pub struct Sum {
    pub turn: [f64; 2],
    pub orbit: [f64; 2],
    pub pan: [f64; 2],
    pub fly: [f64; 3],
    pub roll: f64,
    pub dolly: f64,
    pub zoom: f64,
    /// Seconds of the animation.
    pub play: f64,
    pub pace: Option<[f64; 2]>,
    pub pick: Option<([f64; 2], bool)>,
    pub focus: Option<[f64; 2]>,
    pub pivot: Option<[f64; 2]>,
    pub follow: Option<[f64; 2]>,
}

impl Sum {
    /// Returns one command per kind, in an order in which they do not affect each other.
    pub fn into_commands(self) -> Vec<Command> {
        let mut commands = Vec::new();
        let mut push = |wanted: bool, command| {
            if wanted {
                commands.push(command);
            }
        };
        let zero = [0.0; 2];
        push(self.turn != zero, Command::Turn { yaw_deg: self.turn[0], pitch_deg: self.turn[1] });
        push(self.orbit != zero, Command::Orbit { yaw_deg: self.orbit[0], pitch_deg: self.orbit[1] });
        push(self.pan != zero, Command::Pan { right: self.pan[0], up: self.pan[1] });
        if let Some([x, y]) = self.pace {
            commands.push(Command::PaceAt { x, y });
        }
        let mut push = |wanted: bool, command| {
            if wanted {
                commands.push(command);
            }
        };
        let [right, up, forward] = self.fly;
        push(self.fly != [0.0; 3], Command::Fly { right, up, forward });
        push(self.roll != 0.0, Command::Roll { angle_deg: self.roll });
        push(self.dolly != 0.0, Command::Dolly { factor: self.dolly.exp() });
        push(self.zoom != 0.0, Command::Zoom { factor: self.zoom.exp() });
        push(self.play != 0.0, Command::AdvanceMoment { seconds: self.play });
        if let Some(([x, y], add)) = self.pick {
            commands.push(Command::Edit(Edit::PickAt { x, y, add }));
        }
        if let Some([x, y]) = self.focus {
            commands.push(Command::FocusAt { x, y });
        }
        if let Some([x, y]) = self.pivot {
            commands.push(Command::PivotAt { x, y });
        }
        if let Some([x, y]) = self.follow {
            commands.push(Command::FocusFollows { x, y });
        }
        commands
    }
}

pub fn add(sum: &mut [f64; 2], step: [f64; 2]) {
    sum[0] += step[0];
    sum[1] += step[1];
}
