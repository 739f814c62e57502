#pragma once
// Bounds XML text before a recursive parser sees it.
#include <cstddef>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::robot {

struct XmlLimits {
  std::size_t max_bytes{0};
  std::size_t max_depth{0};
  std::size_t max_elements{0};
};

/// Checks size, element nesting and element count of `text` without recursion and without heap: O(size).
/// Errors: kUnsupported (a limit is exceeded), kMalformed (NUL byte, document type, tags that do not nest, unfinished
/// comment or tag). Success does not mean well-formed; it means that a recursive parser stays within the limits.
[[nodiscard]] Status check_xml_bounds(std::string_view text, const XmlLimits& limits) noexcept;

}  // namespace embody::robot
