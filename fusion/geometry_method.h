#pragma once

#include <array>
#include <string_view>

namespace imprint {

/// How the tangents of all cameras become a geometry.
enum class GeometryMethod {
  joint,   ///< one estimate from all tangents (fusion/combine)
  thesis,  ///< the axis as the middle of the rims, [D] equations 1 to 6 (fusion/thesis)
};

/// In the order of GeometryMethod.
inline constexpr auto kGeometryMethods = std::to_array<std::string_view>({"joint", "thesis"});

constexpr std::string_view name_of(GeometryMethod method) { return kGeometryMethods[static_cast<std::size_t>(method)]; }

/// One of kGeometryMethods; anything else is joint.
constexpr GeometryMethod geometry_method_of(std::string_view name) {
  return name == kGeometryMethods[1] ? GeometryMethod::thesis : GeometryMethod::joint;
}

}  // namespace imprint
