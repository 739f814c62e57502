// Any bytes as a hand model: they are refused with a sentence, or the model is whole and reads back as the same.
#include <cstdint>
#include <cstdlib>

#include "drivers/mano/mano_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace embody::mano;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto array = parse_npy(bytes, "fuzz", 10'000)) {
    std::size_t count = 1;
    for (const std::size_t n : array->shape) count *= n;
    if (count != array->values.size() || count > 10'000) std::abort();
  }
  const auto model = parse_model(bytes);
  if (!model) {
    if (model.error().detail.view().empty()) std::abort();
    return 0;
  }
  const auto again = parse_model(format_model(*model));
  if (!again || again->weights != model->weights || again->pose_correctives != model->pose_correctives) std::abort();
  return 0;
}
