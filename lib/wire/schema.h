#pragma once

#include <string>
#include <string_view>

namespace imprint {

/// The serialised `google.protobuf.FileDescriptorSet` that describes a message of `imprint.v1`, e.g. "Imprint", for
/// readers that know nothing of it; empty when there is no such message.
std::string schema_of(std::string_view message);

}  // namespace imprint
