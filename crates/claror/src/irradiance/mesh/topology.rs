//! The triangulation of the concentric grid: the same for all records with as many cells.

use crate::irradiance::hemisphere::Grid;

/// A directed edge between two cells' hit points, with the faces on both sides.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(super) struct Edge {
    /// Cell where it starts.
    pub(super) a: u32,
    /// Cell where it ends.
    pub(super) b: u32,
    /// The triangle that runs along it from `a` to `b`.
    pub(super) left: u32,
    /// The triangle that runs from `b` to `a`; from the number of triangles on, the strip between
    /// this edge and the tangent plane.
    pub(super) right: u32,
    /// Where `a` and `b` are among the corners of all faces, three for each: in the left face, and
    /// in the right one. A strip has its edge's start and end as the first two.
    pub(super) corners: [[u32; 2]; 2],
}

/// The triangulation of an `n × n` concentric grid. Build it once per `n` and share it.
#[derive(Debug, Clone)]
pub struct MeshTopology {
    pub(super) n: u32,
    /// Corners, counter-clockwise about the normal.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Edges of each triangle, edge k from corner k to corner k + 1.
    pub(super) triangle_edges: Vec<[u32; 3]>,
    /// All edges, in a fixed order; the outermost ones last, as the rim runs.
    pub(super) edges: Vec<Edge>,
    /// How many edges are not on the rim.
    pub(super) interior: usize,
}

impl MeshTopology {
    /// For an `n × n` grid. Grids with less than 2 × 2 cells have no triangles.
    pub fn new(n: u32) -> Self {
        let mut triangles = Vec::new();
        for j in 1..n {
            for i in 1..n {
                let at = |i: u32, j: u32| j * n + i;
                let (a, b) = (at(i - 1, j - 1), at(i, j - 1));
                let (c, d) = (at(i, j), at(i - 1, j));
                triangles.push([a, b, c]);
                triangles.push([a, c, d]);
            }
        }
        let (mut edges, interior) = edges(n, &triangles);
        let mut triangle_edges = vec![[0; 3]; triangles.len()];
        for (index, edge) in edges.iter_mut().enumerate() {
            edge.corners = [edge.left, edge.right].map(|face| {
                let Some(corners) = triangles.get(face as usize) else {
                    return [3 * face, 3 * face + 1];
                };
                let find = |v: u32| corners.iter().position(|&c| c == v).unwrap_or(0);
                let (a, b) = (find(edge.a), find(edge.b));
                // Edge k runs between the corners k and k + 1.
                let k = if (a + 1) % 3 == b { a } else { b };
                triangle_edges[face as usize][k] = index as u32;
                [3 * face + a as u32, 3 * face + b as u32]
            });
        }
        Self { n, triangles, triangle_edges, edges, interior }
    }

    /// The grid that this triangulates.
    pub fn grid(&self) -> Grid {
        Grid::Concentric { n: self.n }
    }
}

/// Interior edges in the order of their first triangle, then the rim, counter-clockwise; and how
/// many are interior.
fn edges(n: u32, triangles: &[[u32; 3]]) -> (Vec<Edge>, usize) {
    let mut half_edges = Vec::new();
    for (t, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            half_edges.push((a.min(b), a.max(b), t as u32, a < b));
        }
    }
    half_edges.sort_unstable();
    let mut interior = Vec::new();
    let mut left_of = vec![0; (n * n) as usize];
    let mut k = 0;
    while k < half_edges.len() {
        let (low, high, face, forward) = half_edges[k];
        match half_edges.get(k + 1) {
            Some(&(l, h, other, _)) if (l, h) == (low, high) => {
                let (left, right) = if forward { (face, other) } else { (other, face) };
                interior.push(Edge { a: low, b: high, left, right, corners: [[0; 2]; 2] });
                k += 2;
            }
            _ => {
                // On the rim: found again from the cell where it starts.
                left_of[if forward { low } else { high } as usize] = face;
                k += 1;
            }
        }
    }
    interior.sort_by_key(|e| (e.left.min(e.right), e.a, e.b));
    let count = interior.len();
    let rim = rim(n);
    for (k, &a) in rim.iter().enumerate() {
        let b = rim[(k + 1) % rim.len()];
        let right = (triangles.len() + k) as u32;
        interior.push(Edge { a, b, left: left_of[a as usize], right, corners: [[0; 2]; 2] });
    }
    (interior, count)
}

/// The outermost cells, counter-clockwise about the normal.
fn rim(n: u32) -> Vec<u32> {
    if n < 2 {
        return Vec::new();
    }
    let last = n - 1;
    let south = 0..last;
    let east = (0..last).map(|j| j * n + last);
    let north = (0..last).map(|i| last * n + last - i);
    let west = (0..last).map(|j| (last - j) * n);
    south.chain(east).chain(north).chain(west).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_edge_is_used_once_in_each_direction() {
        for n in [2, 3, 7, 24] {
            let mesh = MeshTopology::new(n);
            assert_eq!(mesh.triangles.len() as u32, 2 * (n - 1) * (n - 1));
            assert_eq!(mesh.edges.len() - mesh.interior, 4 * (n as usize - 1));
            let follows = |t: u32, a: u32, b: u32| {
                let c = mesh.triangles[t as usize];
                (0..3).any(|k| c[k] == a && c[(k + 1) % 3] == b)
            };
            for (k, e) in mesh.edges.iter().enumerate() {
                assert!(follows(e.left, e.a, e.b), "{n} {e:?}");
                if k < mesh.interior {
                    assert!(follows(e.right, e.b, e.a), "{n} {e:?}");
                } else {
                    assert_eq!(e.right as usize, mesh.triangles.len() + k - mesh.interior);
                }
            }
            for (t, edges) in mesh.triangle_edges.iter().enumerate() {
                for (k, &edge) in edges.iter().enumerate() {
                    let (a, b) = (mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
                    let e = mesh.edges[edge as usize];
                    assert_eq!((e.a.min(e.b), e.a.max(e.b)), (a.min(b), a.max(b)));
                }
            }
        }
        assert!(MeshTopology::new(1).triangles.is_empty());
    }
}
