//! Rays per second on one thread: `cargo bench -p intrados-scene`. A ray is an item; look at the fastest column on a shared machine.

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use divan::{Bencher, black_box, counter::ItemsCount};
use intrados_scene::tracer::{Hit, Kernel, Ray, Scratch, Tracer};

fn main() {
    divan::main();
}

/// Rays a batch: what a path tracer has in flight.
const BATCH: usize = 4096;

fn closest(bencher: Bencher, tracer: &Tracer, rays: &[Ray]) {
    let (mut hits, mut scratch) = ([Hit::MISS; BATCH], Scratch::default());
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        for batch in rays.chunks(BATCH) {
            tracer.closest(batch, &mut hits[..batch.len()], &mut scratch);
            black_box(&hits);
        }
    });
}

fn any(bencher: Bencher, tracer: &Tracer, rays: &[Ray]) {
    let (mut blocked, mut scratch) = ([false; BATCH], Scratch::default());
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        for batch in rays.chunks(BATCH) {
            tracer.any(batch, &mut blocked[..batch.len()], &mut scratch);
            black_box(&blocked);
        }
    });
}

/// Incoherent rays in 100 000 triangles.
mod tunnel {
    use super::*;

    const RAYS: u64 = 100_000;

    #[divan::bench(sample_count = 20)]
    fn closest(bencher: Bencher) {
        super::closest(bencher, &Tracer::build(&shapes::tunnel(500, 100)), &shapes::tunnel_rays(RAYS));
    }

    #[divan::bench(sample_count = 20)]
    fn any(bencher: Bencher) {
        super::any(bencher, &Tracer::build(&shapes::tunnel(500, 100)), &shapes::tunnel_rays(RAYS));
    }

    #[divan::bench(sample_count = 10)]
    fn aimed(bencher: Bencher) {
        let triangles = shapes::tunnel(500, 100);
        super::closest(bencher, &Tracer::build(&triangles), &shapes::aimed_rays(&triangles));
    }

    #[divan::bench(sample_count = 10)]
    fn build(bencher: Bencher) {
        let triangles = shapes::tunnel(500, 100);
        bencher.counter(ItemsCount::new(triangles.len())).bench_local(|| Tracer::build(&triangles));
    }
}

/// The rays of diffuse walks in a room, each edge cut into so many: 36·k² triangles.
mod room {
    use super::*;

    const WALKS: u64 = 1 << 14;
    const CUTS: [usize; 5] = [1, 2, 4, 8, 54];

    #[divan::bench(sample_count = 20, args = CUTS, consts = [true, false])]
    fn closest<const PACKETS: bool>(bencher: Bencher, cut: usize) {
        super::closest(bencher, &build::<PACKETS>(cut), &shapes::room_rays(WALKS).0);
    }

    #[divan::bench(sample_count = 20, args = CUTS, consts = [true, false])]
    fn any<const PACKETS: bool>(bencher: Bencher, cut: usize) {
        super::any(bencher, &build::<PACKETS>(cut), &shapes::room_rays(WALKS).1);
    }

    fn build<const PACKETS: bool>(cut: usize) -> Tracer {
        let kernel = if PACKETS { Kernel::Packet } else { Kernel::Single };
        Tracer::build_with(&shapes::cut(&shapes::room(), cut), kernel)
    }
}
