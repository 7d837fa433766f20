"""Writes page.html into a C++ source, so that the program needs no files beside it: embed_page.py page.html page.cc"""
import sys

source, target = sys.argv[1:]
with open(source, encoding="utf-8") as file:
    text = file.read()
# Compilers limit the length of one literal; neighbouring ones are joined.
pieces = [text[i:i + 8000] for i in range(0, len(text), 8000)]
with open(target, "w", encoding="utf-8") as file:
    file.write('#include "fusion/serve/page.h"\n\nnamespace imprint {\n\nusing namespace std::string_view_literals;\n\n')
    file.write("const std::string_view kPage =\n")
    file.write("\n".join(f'R"imprint_page({piece})imprint_page"' for piece in pieces))
    file.write("sv;\n\n}  // namespace imprint\n")
