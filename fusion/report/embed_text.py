"""Writes a text into a C++ source, so that the programs need no files beside them:

embed_text.py TEXT HEADER NAME SOURCE [LOOK]

`NAME` is a std::string_view that HEADER declares. A line `/* look */` of the text becomes the style sheet LOOK.
"""
import sys

text_file, header, name, target, *look = sys.argv[1:]
with open(text_file, encoding="utf-8") as file:
    text = file.read()
if look:
    with open(look[0], encoding="utf-8") as file:
        text = text.replace("/* look */\n", file.read())
# Compilers limit the length of one literal; neighbouring ones are joined.
pieces = [text[i:i + 8000] for i in range(0, len(text), 8000)]
with open(target, "w", encoding="utf-8") as file:
    file.write(f'#include "{header}"\n\nnamespace imprint {{\n\nusing namespace std::string_view_literals;\n\n')
    file.write(f"const std::string_view {name} =\n")
    file.write("\n".join(f'R"imprint_text({piece})imprint_text"' for piece in pieces))
    file.write("sv;\n\n}  // namespace imprint\n")
