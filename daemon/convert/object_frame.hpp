#pragma once
// Pose of an object that carries three markers.
#include <array>
#include <optional>

#include "core/hal/types.hpp"

namespace embody::convert {

/// Frame O of an object: origin in the first marker, +x towards the second, the third in the xy plane on the side of
/// +y. Nothing when a marker is not seen, or when they hardly span a plane: the second closer than 1 mm to the first,
/// or the third closer than 1 mm to the x axis.
[[nodiscard]] std::optional<Pose> object_frame(const std::array<Marker, 3>& markers) noexcept;

}  // namespace embody::convert
