#pragma once
#include <cstdlib>

#include "tests/support/temporary_folder.hpp"

namespace vergence::test {

/// Errors that a strict XML parser finds in documents; empty: they are well-formed.
inline std::string xml_problem(const std::vector<std::string>& documents) {
  const TemporaryFolder folder;
  const std::string said = (folder / "said").string();
  std::string command =
      "python3 -c 'import sys, xml.parsers.expat as x\n"
      "for f in sys.argv[1:]: print(f); x.ParserCreate().ParseFile(open(f, \"rb\"))'";
  for (std::size_t i = 0; i < documents.size(); ++i)
    command += " '" + folder.write(std::to_string(i), documents[i]).string() + "'";
  return std::system((command + " >'" + said + "' 2>&1").c_str()) == 0 ? "" : read_file(said);
}

}  // namespace vergence::test
