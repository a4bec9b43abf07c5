// Writes the tables of docs/configuration.md again; the target `docs` runs it.
#include "app/config/schema.hpp"
#include "app/runtime/durable_file.hpp"

#include <fstream>
#include <iterator>

int main(int /*argc*/, char** argv) {
  std::ifstream in(argv[1]);
  const std::string document(std::istreambuf_iterator<char>(in), {});
  vergence::app::replace_durably(argv[1], vergence::app::refresh_document(document));
}
