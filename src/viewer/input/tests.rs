use super::*;
use winit::keyboard::KeyCode;

const NONE: ModifiersState = ModifiersState::empty();

fn input() -> (Input, Instant) {
    (Input::new(800, 400, Navigation::Firstlight), Instant::now())
}

fn after(start: Instant, ms: u64) -> Instant {
    start + Duration::from_millis(ms)
}

fn press(input: &mut Input, code: KeyCode, text: &str, down: bool, now: Instant) -> Option<Action> {
    input.key(PhysicalKey::Code(code), &Key::Character(text.into()), down, false, now)
}

#[test]
fn how_far_a_key_flies_does_not_depend_on_the_frame_rate() {
    for frame_ms in [1, 7, 16, 100, 2000] {
        let (mut input, start) = input();
        press(&mut input, KeyCode::KeyW, "w", true, start);
        let mut flown = 0.0;
        let mut collect = |input: &mut Input, now| {
            for command in input.take(now) {
                if let Command::PaceAt { .. } = command {
                    continue;
                }
                let Command::Fly { right: 0.0, up: 0.0, forward } = command else { panic!("{command:?}") };
                flown += forward;
            }
        };
        let mut ms = 0;
        while ms + frame_ms < 1000 {
            ms += frame_ms;
            collect(&mut input, after(start, ms));
        }
        press(&mut input, KeyCode::KeyW, "w", false, after(start, 1000));
        collect(&mut input, after(start, 5000));
        assert!((flown - 1.0).abs() < 1e-9, "{frame_ms} ms: {flown}");
        assert!(!input.is_moving());
    }
}

#[test]
fn speed_and_shift_count_from_when_they_change() {
    let (mut input, start) = input();
    press(&mut input, KeyCode::KeyW, "w", true, start);
    input.wheel(1.0, after(start, 1000));
    input.set_modifiers(ModifiersState::SHIFT, after(start, 2000));
    let [Command::PaceAt { .. }, Command::Fly { forward, .. }] = input.take(after(start, 3000))[..] else { panic!() };
    assert!((forward - (1.0 + SPEED_NOTCH + FAST * SPEED_NOTCH)).abs() < 1e-9, "{forward}");
}

#[test]
fn a_tap_moves_and_opposite_keys_stand_still() {
    let (mut input, start) = input();
    press(&mut input, KeyCode::KeyD, "d", true, start);
    press(&mut input, KeyCode::KeyD, "d", false, start);
    let pace = Command::PaceAt { x: 0.0, y: 0.0 };
    assert_eq!(input.take(start), [pace.clone(), Command::Fly { right: TAP, up: 0.0, forward: 0.0 }]);
    press(&mut input, KeyCode::KeyA, "a", true, start);
    press(&mut input, KeyCode::KeyD, "d", true, start);
    assert_eq!(input.take(after(start, 500)), [pace]);
}

#[test]
fn shift_flies_faster_and_turns_orbiting_into_panning() {
    let (mut input, start) = input();
    input.set_modifiers(ModifiersState::SHIFT, start);
    press(&mut input, KeyCode::KeyE, "E", true, start);
    press(&mut input, KeyCode::ArrowLeft, "", true, start);
    let commands = input.take(after(start, 1000));
    assert_eq!(
        commands,
        [
            Command::Pan { right: -PAN_RATE, up: 0.0 },
            Command::PaceAt { x: 0.0, y: 0.0 },
            Command::Fly { right: 0.0, up: FAST, forward: 0.0 }
        ]
    );
}

#[test]
fn ctrl_letters_do_not_fly() {
    let (mut input, start) = input();
    input.set_modifiers(ModifiersState::CONTROL, start);
    assert_eq!(press(&mut input, KeyCode::KeyQ, "q", true, start), Some(Action::Quit));
    assert_eq!(press(&mut input, KeyCode::KeyW, "w", true, start), None);
    assert!(!input.is_moving());
}

#[test]
fn losing_the_keyboard_lets_everything_go() {
    let (mut input, start) = input();
    press(&mut input, KeyCode::KeyW, "w", true, start);
    input.button(MouseButton::Middle, true, start);
    input.release_all(after(start, 100));
    input.cursor(300.0, 300.0);
    let commands = input.take(after(start, 900));
    assert_eq!(commands[1..], [Command::Fly { right: 0.0, up: 0.0, forward: 0.1 }]);
}

#[test]
fn drags_follow_the_mouse_and_add_up() {
    let (mut input, start) = input();
    input.cursor(100.0, 100.0);
    input.button(MouseButton::Left, true, start);
    input.cursor(102.0, 100.0);
    assert_eq!(input.take(start), [], "a trembling mouse turns nothing");
    input.cursor(150.0, 100.0);
    input.cursor(200.0, 60.0);
    let commands = input.take(start);
    assert_eq!(commands, [Command::Turn { yaw_deg: 0.25 * LOOK_DRAG_DEG, pitch_deg: 0.1 * LOOK_DRAG_DEG }]);
    input.button(MouseButton::Left, false, start);
    input.cursor(400.0, 400.0);
    assert_eq!(input.take(start), []);

    input.button(MouseButton::Middle, true, start);
    input.cursor(440.0, 400.0);
    assert_eq!(input.take(start), [Command::Orbit { yaw_deg: -0.1 * ORBIT_DRAG_DEG, pitch_deg: 0.0 }]);
    input.button(MouseButton::Middle, false, start);
    input.button(MouseButton::Right, true, start);
    input.cursor(440.0, 440.0);
    assert_eq!(input.take(start), [Command::Pan { right: 0.0, up: 0.1 }]);
}

#[test]
fn clicks_focus() {
    let (mut input, start) = input();
    input.cursor(200.0, 100.0);
    input.button(MouseButton::Left, true, start);
    input.button(MouseButton::Left, false, start);
    let picked = |add| Command::Edit(Edit::PickAt { x: 0.25, y: 0.25, add });
    assert_eq!(input.take(start), [picked(false)], "one click selects");
    input.button(MouseButton::Left, true, after(start, 200));
    input.button(MouseButton::Left, false, after(start, 250));
    assert_eq!(input.take(start), [Command::FocusAt { x: 0.25, y: 0.25 }, Command::PivotAt { x: 0.25, y: 0.25 }]);
    input.button(MouseButton::Left, true, after(start, 300));
    input.button(MouseButton::Left, false, after(start, 310));
    assert_eq!(input.take(start), [picked(false)], "a third click is not a second double click");
    input.set_modifiers(ModifiersState::CONTROL, start);
    input.button(MouseButton::Left, true, after(start, 1300));
    input.button(MouseButton::Left, false, after(start, 1310));
    assert_eq!(input.take(start), [picked(true)]);

    input.set_modifiers(ModifiersState::SHIFT, start);
    input.button(MouseButton::Left, true, after(start, 2000));
    assert_eq!(input.take(start), [Command::FocusAt { x: 0.25, y: 0.25 }]);
    input.cursor(900.0, 300.0);
    assert_eq!(input.take(start), [Command::FocusAt { x: 1.0, y: 0.75 }], "and a drag pulls it along");
}

#[test]
fn the_wheel_does_three_things() {
    let (mut input, start) = input();
    assert!(!input.wheel(1.0, start));
    input.set_modifiers(ModifiersState::CONTROL, start);
    assert!(input.wheel(2.0, start));
    assert_eq!(input.speed(), SPEED_NOTCH * SPEED_NOTCH);
    input.set_modifiers(ModifiersState::SHIFT, start);
    assert!(!input.wheel(-1.0, start));
    let [Command::Dolly { factor: dolly }, Command::Zoom { factor: zoom }] = input.take(start)[..] else { panic!() };
    assert!((dolly * ZOOM_NOTCH - 1.0).abs() < 1e-12 && (zoom / ZOOM_NOTCH - 1.0).abs() < 1e-12);
    input.set_modifiers(ModifiersState::CONTROL, start);
    for _ in 0..1000 {
        input.wheel(1.0, start);
    }
    assert_eq!(input.speed(), SPEED_RANGE.1);
}

#[test]
fn a_turntable_goes_around_by_itself_until_it_is_stopped() {
    let (mut input, start) = input();
    input.toggle_spin(start);
    assert!(input.is_moving());
    assert_eq!(input.take(after(start, 1500)), [Command::Orbit { yaw_deg: 1.5 * SPIN_RATE_DEG, pitch_deg: 0.0 }]);
    input.toggle_spin(after(start, 2000));
    assert_eq!(input.take(after(start, 9000)), [Command::Orbit { yaw_deg: 0.5 * SPIN_RATE_DEG, pitch_deg: 0.0 }]);
    assert!(!input.is_moving());
}

#[test]
fn steps_repeat_and_toggles_do_not() {
    let (mut input, start) = input();
    let mut repeat =
        |code, text: &str| input.key(PhysicalKey::Code(code), &Key::Character(text.into()), true, true, start);
    assert!(repeat(KeyCode::BracketLeft, "[").is_some());
    assert_eq!(repeat(KeyCode::KeyO, "o"), None);
    assert_eq!(repeat(KeyCode::KeyK, "k"), None);
}

#[test]
fn a_drag_orbits_things_until_another_use_is_chosen_for_the_scene_and_a_captured_mouse_looks() {
    let (mut input, start) = input();
    input.set_in_room(false);
    let orbits = |input: &mut Input| {
        input.button(MouseButton::Left, true, start);
        let [x, y] = input.cursor_place();
        input.cursor(x + 40.0, y);
        input.button(MouseButton::Left, false, start);
        matches!(input.take(start)[..], [Command::Orbit { .. }])
    };
    assert!(orbits(&mut input));
    input.set_captured(true);
    input.mouse_moved(40.0, 0.0);
    assert!(matches!(input.take(start)[..], [Command::Turn { .. }]));
    input.set_captured(false);
    assert!(!input.toggle_orbits() && !orbits(&mut input), "Space");
    input.forget_drag();
    assert!(orbits(&mut input), "another scene");
    input.set_in_room(true);
    assert!(!orbits(&mut input));
    assert!(input.toggle_orbits() && orbits(&mut input));
    // A drag of which another use is made turns nothing.
    input.button(MouseButton::Left, true, start);
    input.drop_drag();
    input.cursor(0.0, 0.0);
    assert_eq!(input.take(start), []);
}

#[test]
fn a_drag_looks_or_orbits_and_a_captured_mouse_needs_no_button() {
    let (mut input, start) = input();
    assert!(input.toggle_orbits());
    input.button(MouseButton::Left, true, start);
    input.cursor(40.0, 0.0);
    assert_eq!(input.take(start), [Command::Orbit { yaw_deg: -0.1 * ORBIT_DRAG_DEG, pitch_deg: 0.0 }]);
    input.button(MouseButton::Left, false, start);
    assert!(!input.toggle_orbits());
    input.mouse_moved(40.0, 40.0);
    assert_eq!(input.take(start), [], "a free mouse points, and turns nothing");
    input.set_captured(true);
    input.mouse_moved(30.0, 0.0);
    input.mouse_moved(10.0, 40.0);
    input.button(MouseButton::Left, true, start);
    input.cursor(300.0, 300.0);
    let turned = Command::Turn { yaw_deg: 0.1 * LOOK_DRAG_DEG, pitch_deg: -0.1 * LOOK_DRAG_DEG };
    assert_eq!(input.take(start), [turned], "and no button drags it");
    input.set_captured(false);
    input.mouse_moved(30.0, 0.0);
    assert_eq!(input.take(start), []);
}

#[test]
fn a_focus_that_follows_goes_where_the_mouse_goes() {
    let (mut input, start) = input();
    input.cursor(10.0, 10.0);
    assert_eq!(input.take(start), []);
    input.set_focuses(true);
    input.cursor(200.0, 100.0);
    input.cursor(400.0, 100.0);
    assert_eq!(input.take(start), [Command::FocusFollows { x: 0.5, y: 0.25 }]);
    input.cursor(400.0, 100.0);
    assert_eq!(input.take(start), [], "a mouse that stands still asks for nothing");
}

#[test]
fn an_animation_stops_where_it_was_shown() {
    let (mut input, start) = (Input::new(800, 400, Navigation::Firstlight), Instant::now());
    input.toggle_play(start);
    let later = start + Duration::from_millis(100);
    assert!(matches!(input.take(later)[..], [Command::AdvanceMoment { seconds }] if (seconds - 0.1).abs() < 1e-9));
    input.toggle_play(later + Duration::from_millis(30));
    assert_eq!(input.take(later + Duration::from_millis(60)), [], "the whole frame that it stops at stays");
}

#[test]
fn a_drag_with_ctrl_orbits_and_a_click_with_ctrl_adds_to_the_selection() {
    for navigation in Navigation::ALL {
        let (mut input, start) = (Input::new(800, 400, navigation), Instant::now());
        input.set_modifiers(ModifiersState::CONTROL, start);
        input.button(MouseButton::Left, true, start);
        input.cursor(100.0, 0.0);
        assert!(matches!(input.take(start)[..], [Command::Orbit { .. }]));
        input.button(MouseButton::Left, false, start);
        assert_eq!(input.take(start), []);
        input.button(MouseButton::Left, true, start);
        input.button(MouseButton::Left, false, start);
        assert!(matches!(input.take(start)[..], [Command::Edit(Edit::PickAt { add: true, .. })]));
    }
}

/// Returns the commands of a drag to the right with these modifiers.
fn dragged(navigation: Navigation, button: MouseButton, modifiers: ModifiersState) -> Vec<Command> {
    let (mut input, start) = (Input::new(800, 400, navigation), Instant::now());
    input.set_modifiers(modifiers, start);
    input.button(button, true, start);
    input.cursor(100.0, 0.0);
    input.take(start)
}

#[test]
fn drags_are_those_of_the_program_that_was_chosen() {
    use MouseButton::{Left, Middle, Right};
    use Navigation::{Blender, Firstlight, Maya};
    let (ctrl, alt, shift) = (ModifiersState::CONTROL, ModifiersState::ALT, ModifiersState::SHIFT);
    for (navigation, button, modifiers) in [
        (Firstlight, Middle, NONE),
        (Firstlight, Left, alt),
        (Blender, Middle, NONE),
        (Blender, Left, alt),
        (Maya, Left, alt),
    ] {
        let commands = dragged(navigation, button, modifiers);
        assert!(matches!(commands[..], [Command::Orbit { .. }]), "{navigation:?} {button:?}: {commands:?}");
    }
    for (navigation, button, modifiers) in [
        (Firstlight, Right, NONE),
        (Blender, Middle, shift),
        (Blender, Left, alt | shift),
        (Maya, Middle, alt),
        (Maya, Middle, ctrl),
    ] {
        let commands = dragged(navigation, button, modifiers);
        assert!(matches!(commands[..], [Command::Pan { .. }]), "{navigation:?} {button:?}: {commands:?}");
    }
    for (navigation, button, modifiers) in
        [(Blender, Middle, ctrl), (Blender, Left, alt | ctrl), (Maya, Right, alt), (Maya, Right, ctrl)]
    {
        let commands = dragged(navigation, button, modifiers);
        let [Command::Dolly { factor }] = commands[..] else { panic!("{navigation:?} {button:?}: {commands:?}") };
        assert!(factor < 1.0, "to the right is nearer");
    }
}

#[test]
fn shift_with_a_click_adds_to_the_selection_where_other_programs_do() {
    use Navigation::{Blender, Firstlight, Maya};
    for navigation in [Firstlight, Blender, Maya] {
        let (mut input, start) = (Input::new(800, 400, navigation), Instant::now());
        input.set_modifiers(ModifiersState::SHIFT, start);
        input.cursor(200.0, 100.0);
        input.button(MouseButton::Left, true, start);
        input.button(MouseButton::Left, false, start);
        let commands = input.take(start);
        let is_as_expected = match navigation {
            Firstlight => matches!(commands[..], [Command::FocusAt { .. }]),
            Blender | Maya => matches!(commands[..], [Command::Edit(Edit::PickAt { add: true, .. })]),
        };
        assert!(is_as_expected, "{navigation:?}: {commands:?}");
        let commands = dragged(navigation, MouseButton::Left, ModifiersState::SHIFT);
        assert!(matches!(commands[..], [Command::FocusAt { x: 0.125, .. }]), "{navigation:?}: {commands:?}");
    }
}

#[test]
fn under_a_preset_the_wheel_zooms_and_letters_fly_only_with_the_right_button() {
    for navigation in [Navigation::Blender, Navigation::Maya] {
        let (mut input, start) = (Input::new(800, 400, navigation), Instant::now());
        assert!(!input.wheel(1.0, start));
        assert!(matches!(input.take(start)[..], [Command::Dolly { factor }] if factor < 1.0));
        // A letter alone selects a tool, and moves nothing.
        let (code, text) = if navigation == Navigation::Maya { (KeyCode::KeyW, "w") } else { (KeyCode::KeyS, "s") };
        assert!(matches!(press(&mut input, code, text, true, start), Some(Action::Gizmo(Some(_)) | Action::Grab(_))));
        press(&mut input, code, text, false, after(start, 50));
        assert_eq!(input.take(after(start, 100)), []);
        // With the right button it flies, at the speed set by the wheel, until the button is released.
        input.button(MouseButton::Right, true, start);
        assert!(input.wheel(1.0, start));
        assert_eq!(press(&mut input, KeyCode::KeyW, "w", true, start), None);
        assert!(!input.button(MouseButton::Right, false, after(start, 1000)), "it is no click, though nothing moved");
        let commands = input.take(after(start, 5000));
        let Some(Command::Fly { forward, .. }) = commands.last() else { panic!("{commands:?}") };
        assert!((forward - SPEED_NOTCH).abs() < 1e-9 && !input.is_moving(), "{forward}");
        // The arrow keys orbit as without a preset.
        press(&mut input, KeyCode::ArrowLeft, "", true, start);
        assert!(input.is_moving());
    }
}

#[test]
fn with_the_keys_of_maya_z_undoes_and_s_sets_keys() {
    use crate::frame::Edit;
    let typed = |navigation, code, letter: &str| {
        let (mut input, start) = input();
        input.set_navigation(navigation, start);
        let key = Key::Character(letter.into());
        (input.key(PhysicalKey::Code(code), &key, true, false, start), input.is_moving())
    };
    let edit = |edit| Some(Action::Send(Command::Edit(edit)));
    assert_eq!(typed(Navigation::Maya, KeyCode::KeyZ, "z"), (edit(Edit::Undo), false));
    assert_eq!(typed(Navigation::Maya, KeyCode::KeyS, "s"), (edit(Edit::SetKeys { camera: false }), false));
    assert_eq!(typed(Navigation::Firstlight, KeyCode::KeyZ, "z"), (None, true), "it rolls");
}
