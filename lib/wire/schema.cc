#include "lib/wire/schema.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include "delivery.pb.h"
#include "health.pb.h"
#include "imprint.pb.h"

namespace imprint {

std::string schema_of(std::string_view message) {
  // Each file of the schema stands for itself: none imports another.
  const google::protobuf::FileDescriptor* files[] = {
      v1::Imprint::descriptor()->file(), v1::Health::descriptor()->file(), v1::Receipt::descriptor()->file()};
  for (const auto* file : files) {
    if (file->FindMessageTypeByName(std::string(message)) == nullptr) continue;
    google::protobuf::FileDescriptorSet set;
    file->CopyTo(set.add_file());
    return set.SerializeAsString();
  }
  return {};
}

}  // namespace imprint
