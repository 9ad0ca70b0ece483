//! A Vulkan layer that loses things when it is told to: a library of its own, compiled by the test that uses it.
//!
//! It looks for the file that `FIRSTLIGHT_LOSE` names whenever an image of a window is asked for. The `VkResult` in there
//! is the answer from then on, as from a driver: for as long as the swapchain lives (`VK_ERROR_OUT_OF_DATE_KHR`), its
//! surface (`VK_ERROR_SURFACE_LOST_KHR`) or the device (`VK_ERROR_DEVICE_LOST`). The file is removed.
//!
//! Names and layouts are those of the Vulkan specification and of the loader's interface to layers; everything that is
//! not about windows goes straight to the driver.
#![allow(unsafe_op_in_unsafe_fn)]

use std::ffi::{CStr, c_char, c_void};
use std::mem::transmute;
use std::sync::Mutex;

type VkResult = i32;
type Function = unsafe extern "C" fn();
type GetProcAddr = unsafe extern "C" fn(*mut c_void, *const c_char) -> Option<Function>;
type CreateInstance = unsafe extern "C" fn(*const c_void, *const c_void, *mut *mut c_void) -> VkResult;
type CreateDevice = unsafe extern "C" fn(*mut c_void, *const c_void, *const c_void, *mut *mut c_void) -> VkResult;
type CreateSwapchain = unsafe extern "C" fn(*mut c_void, *const SwapchainInfo, *const c_void, *mut u64) -> VkResult;
type Acquire = unsafe extern "C" fn(*mut c_void, u64, u64, u64, u64, *mut u32) -> VkResult;

const OUT_OF_DATE: VkResult = -1000001004;
const SURFACE_LOST: VkResult = -1000000000;
const DEVICE_LOST: VkResult = -4;

const LOADER_INSTANCE_CREATE_INFO: i32 = 47;
const LOADER_DEVICE_CREATE_INFO: i32 = 48;
const LINK_INFO: i32 = 0;

/// How every structure of Vulkan begins.
#[repr(C)]
struct Base {
    kind: i32,
    next: *mut Base,
}

/// How the loader tells a layer who comes after it.
#[repr(C)]
struct LinkInfo {
    base: Base,
    function: i32,
    link: *mut Link,
}

#[repr(C)]
struct Link {
    next: *mut Link,
    instance_function: GetProcAddr,
    /// Of a device link only; else that of physical devices, if there is one.
    device_function: Option<GetProcAddr>,
}

/// The beginning of a `VkSwapchainCreateInfoKHR`.
#[repr(C)]
struct SwapchainInfo {
    base: Base,
    flags: u32,
    surface: u64,
}

struct State {
    instance: usize,
    next_instance: Option<GetProcAddr>,
    next_device: Option<GetProcAddr>,
    /// Swapchains with their surface.
    swapchains: Vec<(u64, u64)>,
    /// What is lost: a swapchain, a surface, a device.
    lost: Vec<(VkResult, u64)>,
}

static STATE: Mutex<State> =
    Mutex::new(State { instance: 0, next_instance: None, next_device: None, swapchains: Vec::new(), lost: Vec::new() });

/// Takes the layer's own link from the chain and moves the chain on.
unsafe fn take_link(info: *const c_void, kind: i32) -> Option<*mut Link> {
    let mut at = info as *mut Base;
    while !at.is_null() {
        let is_link = (*at).kind == kind && (*at.cast::<LinkInfo>()).function == LINK_INFO;
        if is_link {
            let info = at.cast::<LinkInfo>();
            let link = (*info).link;
            (*info).link = (*link).next;
            return Some(link);
        }
        at = (*at).next;
    }
    None
}

unsafe extern "C" fn create_instance(info: *const c_void, memory: *const c_void, made: *mut *mut c_void) -> VkResult {
    let link = take_link(info, LOADER_INSTANCE_CREATE_INFO).expect("the loader's link");
    let next = (*link).instance_function;
    let create = next(std::ptr::null_mut(), c"vkCreateInstance".as_ptr()).expect("a driver");
    let result = transmute::<Function, CreateInstance>(create)(info, memory, made);
    let mut state = STATE.lock().unwrap();
    (state.instance, state.next_instance) = (*made as usize, Some(next));
    result
}

unsafe extern "C" fn create_device(
    adapter: *mut c_void,
    info: *const c_void,
    memory: *const c_void,
    made: *mut *mut c_void,
) -> VkResult {
    let link = take_link(info, LOADER_DEVICE_CREATE_INFO).expect("the loader's link");
    let instance = STATE.lock().unwrap().instance as *mut c_void;
    let create = ((*link).instance_function)(instance, c"vkCreateDevice".as_ptr()).expect("a driver");
    let result = transmute::<Function, CreateDevice>(create)(adapter, info, memory, made);
    let mut state = STATE.lock().unwrap();
    state.next_device = (*link).device_function;
    // A new device may have the address of an old one.
    state.lost.retain(|lost| *lost != (DEVICE_LOST, *made as u64));
    result
}

/// The next layer's function of this name.
unsafe fn next(device: *mut c_void, name: &CStr) -> Function {
    let next = STATE.lock().unwrap().next_device.expect("a device");
    next(device, name.as_ptr()).expect("a driver for windows")
}

unsafe extern "C" fn create_swapchain(
    device: *mut c_void,
    info: *const SwapchainInfo,
    memory: *const c_void,
    made: *mut u64,
) -> VkResult {
    let surface = (*info).surface;
    let lost = STATE.lock().unwrap().lost.clone();
    for (error, what) in [(SURFACE_LOST, surface), (DEVICE_LOST, device as u64)] {
        if lost.contains(&(error, what)) {
            return error;
        }
    }
    let create = transmute::<Function, CreateSwapchain>(next(device, c"vkCreateSwapchainKHR"));
    let result = create(device, info, memory, made);
    let mut state = STATE.lock().unwrap();
    state.lost.retain(|lost| *lost != (OUT_OF_DATE, *made));
    state.swapchains.retain(|(swapchain, _)| swapchain != &*made);
    state.swapchains.push((*made, surface));
    result
}

unsafe extern "C" fn acquire(
    device: *mut c_void,
    swapchain: u64,
    timeout: u64,
    semaphore: u64,
    fence: u64,
    index: *mut u32,
) -> VkResult {
    {
        let mut state = STATE.lock().unwrap();
        let surface = state.swapchains.iter().find(|(known, _)| *known == swapchain).expect("one that was made").1;
        let path = std::env::var_os("FIRSTLIGHT_LOSE").expect("the name of a file");
        if let Ok(text) = std::fs::read_to_string(&path)
            && let Ok(error) = text.trim().parse()
        {
            std::fs::remove_file(&path).expect("a file that can be removed");
            let what = match error {
                OUT_OF_DATE => swapchain,
                SURFACE_LOST => surface,
                DEVICE_LOST => device as u64,
                _ => panic!("{error} is none of the three"),
            };
            state.lost.push((error, what));
        }
        let all = [(OUT_OF_DATE, swapchain), (SURFACE_LOST, surface), (DEVICE_LOST, device as u64)];
        if let Some((error, _)) = all.into_iter().find(|lost| state.lost.contains(lost)) {
            return error;
        }
    }
    let acquire = transmute::<Function, Acquire>(next(device, c"vkAcquireNextImageKHR"));
    acquire(device, swapchain, timeout, semaphore, fence, index)
}

/// The layer's own function of this name.
unsafe fn own(name: *const c_char) -> Option<Function> {
    let function = match CStr::from_ptr(name).to_bytes() {
        b"vkCreateInstance" => create_instance as *const (),
        b"vkCreateDevice" => create_device as *const (),
        b"vkCreateSwapchainKHR" => create_swapchain as *const (),
        b"vkAcquireNextImageKHR" => acquire as *const (),
        b"vkGetInstanceProcAddr" => vkGetInstanceProcAddr as *const (),
        b"vkGetDeviceProcAddr" => vkGetDeviceProcAddr as *const (),
        _ => return None,
    };
    Some(transmute::<*const (), Function>(function))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn vkGetInstanceProcAddr(instance: *mut c_void, name: *const c_char) -> Option<Function> {
    let next = || STATE.lock().unwrap().next_instance;
    own(name).or_else(|| next()?(instance, name))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn vkGetDeviceProcAddr(device: *mut c_void, name: *const c_char) -> Option<Function> {
    let next = || STATE.lock().unwrap().next_device;
    own(name).or_else(|| next()?(device, name))
}
