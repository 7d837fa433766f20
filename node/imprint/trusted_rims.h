#pragma once

#include "node/imprint/make_imprint.h"

namespace imprint {

/// The silhouette with those of its edge points only that the filter trusts: of some weight and near its curve.
Silhouette trusted_rims(const Silhouette& silhouette, const FilteredSilhouette& filtered);

}  // namespace imprint
