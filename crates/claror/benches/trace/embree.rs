//! As much of Embree 3's C interface as tracing single rays through triangle meshes needs, found
//! at run time, so that neither building nor running claror ever depends on it.
#![expect(unsafe_code, reason = "calls of a C library that is loaded at run time")]

use claror::math::Ray;
use claror::shape::{ShapeKind, ShapeTable};
use libloading::{Library, Symbol};
use std::ffi::{c_char, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::ptr;

type Handle = *mut c_void;

/// `RTCRay`.
#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// `RTCRayHit` with one level of instances.
#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: u32,
}

/// `RTCIntersectContext` with one level of instances: flags (0 is incoherent), filter, instance.
#[repr(C)]
struct RtcContext {
    flags: c_uint,
    filter: *const c_void,
    instance: c_uint,
}

const INVALID: u32 = u32::MAX;
const GEOMETRY_TYPE_TRIANGLE: c_uint = 0;
const BUFFER_TYPE_INDEX: c_uint = 0;
const BUFFER_TYPE_VERTEX: c_uint = 1;
const FORMAT_UINT3: c_uint = 0x5003;
const FORMAT_FLOAT3: c_uint = 0x9003;
const SCENE_FLAG_ROBUST: c_uint = 1 << 2;

/// With or without `RTC_SCENE_FLAG_ROBUST`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Robustness {
    Default,
    Robust,
}

/// The library and a device.
pub(crate) struct Embree {
    /// Never unloaded: Embree leaves destructors of its own behind for the end of the thread.
    library: ManuallyDrop<Library>,
    device: Handle,
}

/// A scene with the meshes of a [`ShapeTable`].
pub(crate) struct EmbreeScene<'a> {
    embree: &'a Embree,
    scene: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRayHit),
    occluded: unsafe extern "C" fn(Handle, *mut RtcContext, *mut RtcRay),
}

impl Embree {
    pub(crate) fn load() -> Result<Self, libloading::Error> {
        let names = ["libembree3.so.3", "libembree3.so", "libembree3.dylib", "embree3.dll"];
        let mut error = None;
        for name in names {
            // SAFETY: Embree's initialisers have no requirements.
            match unsafe { Library::new(name) } {
                Ok(library) => {
                    let library = ManuallyDrop::new(library);
                    let mut this = Self { library, device: ptr::null_mut() };
                    // SAFETY: `RTCDevice rtcNewDevice(const char*)`.
                    this.device = unsafe {
                        let new: Symbol<'_, unsafe extern "C" fn(*const c_char) -> Handle> =
                            this.library.get(b"rtcNewDevice")?;
                        new(c"threads=1".as_ptr())
                    };
                    return Ok(this);
                }
                Err(e) => error = error.or(Some(e)),
            }
        }
        Err(error.expect("at least one name was tried"))
    }

    /// A function of the library.
    ///
    /// # Safety
    /// `F` must be the C function's type.
    unsafe fn function<F: Copy>(&self, name: &str) -> F {
        // SAFETY: what the caller promised.
        *unsafe { self.library.get::<F>(name.as_bytes()) }.expect("part of every Embree 3")
    }

    /// A scene, built with the default quality on one thread.
    pub(crate) fn scene(&self, shapes: &ShapeTable, robustness: Robustness) -> EmbreeScene<'_> {
        // SAFETY: types and calling order are those of `rtcore_scene.h`; the buffers are written
        // within the sizes with which they were asked for (plus the padding that Embree adds).
        unsafe {
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = self.function("rtcNewScene");
            let set_flags: unsafe extern "C" fn(Handle, c_uint) = self.function("rtcSetSceneFlags");
            let commit: unsafe extern "C" fn(Handle) = self.function("rtcCommitScene");
            let scene = new_scene(self.device);
            if robustness == Robustness::Robust {
                set_flags(scene, SCENE_FLAG_ROBUST);
            }
            for shape in &shapes.shapes {
                if let ShapeKind::Mesh(mesh) = shape.kind {
                    let mesh = &shapes.meshes[mesh.0 as usize];
                    self.attach(scene, &mesh.positions, &mesh.triangles);
                }
            }
            commit(scene);
            EmbreeScene {
                embree: self,
                scene,
                intersect: self.function("rtcIntersect1"),
                occluded: self.function("rtcOccluded1"),
            }
        }
    }

    /// # Safety
    /// `scene` must be one of this device that is not committed yet.
    unsafe fn attach(&self, scene: Handle, positions: &[claror::math::Vec3], faces: &[[u32; 3]]) {
        type NewBuffer =
            unsafe extern "C" fn(Handle, c_uint, c_uint, c_uint, usize, usize) -> *mut c_void;
        // SAFETY: as in `scene`.
        unsafe {
            let new_geometry: unsafe extern "C" fn(Handle, c_uint) -> Handle =
                self.function("rtcNewGeometry");
            let new_buffer: NewBuffer = self.function("rtcSetNewGeometryBuffer");
            let commit: unsafe extern "C" fn(Handle) = self.function("rtcCommitGeometry");
            let attach: unsafe extern "C" fn(Handle, Handle) -> c_uint =
                self.function("rtcAttachGeometry");
            let release: unsafe extern "C" fn(Handle) = self.function("rtcReleaseGeometry");
            let geometry = new_geometry(self.device, GEOMETRY_TYPE_TRIANGLE);
            let buffer = |kind, format, count| new_buffer(geometry, kind, 0, format, 12, count);
            let vertices = buffer(BUFFER_TYPE_VERTEX, FORMAT_FLOAT3, positions.len());
            let indices = buffer(BUFFER_TYPE_INDEX, FORMAT_UINT3, faces.len());
            ptr::copy_nonoverlapping(positions.as_ptr().cast(), vertices, 12 * positions.len());
            ptr::copy_nonoverlapping(faces.as_ptr().cast(), indices, 12 * faces.len());
            commit(geometry);
            attach(scene, geometry);
            release(geometry);
        }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: scenes borrow the device, so all are gone.
        unsafe {
            let release: unsafe extern "C" fn(Handle) = self.function("rtcReleaseDevice");
            release(self.device);
        }
    }
}

impl EmbreeScene<'_> {
    /// Number of rays that hit.
    pub(crate) fn trace(&self, rays: &[Ray], any_hit: bool) -> usize {
        let mut context = RtcContext { flags: 0, filter: ptr::null(), instance: INVALID };
        let hits = rays.iter().filter(|ray| {
            let ray = RtcRay {
                origin: ray.o.to_array(),
                t_near: 0.0,
                direction: ray.d.to_array(),
                time: 0.0,
                t_far: ray.t_max,
                mask: u32::MAX,
                id: 0,
                flags: 0,
            };
            if any_hit { self.occluded(&mut context, ray) } else { self.closest(&mut context, ray) }
        });
        hits.count()
    }

    #[inline]
    fn occluded(&self, context: &mut RtcContext, mut ray: RtcRay) -> bool {
        // SAFETY: `void rtcOccluded1(RTCScene, RTCIntersectContext*, RTCRay*)`.
        unsafe { (self.occluded)(self.scene, context, &raw mut ray) };
        ray.t_far < 0.0
    }

    #[inline]
    fn closest(&self, context: &mut RtcContext, ray: RtcRay) -> bool {
        let mut query = RtcRayHit {
            ray,
            normal: [0.0; 3],
            uv: [0.0; 2],
            primitive: INVALID,
            geometry: INVALID,
            instance: INVALID,
        };
        // SAFETY: `void rtcIntersect1(RTCScene, RTCIntersectContext*, RTCRayHit*)`.
        unsafe { (self.intersect)(self.scene, context, &raw mut query) };
        query.geometry != INVALID
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene is ours and not used again.
        unsafe {
            let release: unsafe extern "C" fn(Handle) = self.embree.function("rtcReleaseScene");
            release(self.scene);
        }
    }
}
