#pragma once
// The built-in hand's own surface, generated from its skeleton.
#include "core/hand/hand_data.hpp"

namespace embody::hand {

/// Replaces `data.mesh` by a surface about the joints and tips of a built-in right hand: five tapered finger tubes with
/// rounded ends and a palm, each a closed 2-manifold with outward normals; they overlap at the knuckles. Every vertex
/// is a point on the skeleton plus an offset: with the shape the first moves as the bone does, the second grows by
/// `data.thickness_directions`. A finger's vertices hang on the wrist and the finger's joints only, the palm's on the
/// wrist. No pose correctives. Radii: mid-phalanx radii of the WebXR generic hand asset (MIT). Allocates.
/// @pre data is a built-in right hand (joints, tips, directions set).
void add_builtin_mesh(HandData& data);

}  // namespace embody::hand
