#!/usr/bin/env python3
"""Counts the public functions of each class in headers below src and include: a class that has many does the work of several.
Constructors, destructors, operators and what is deleted don't count, nor do friends; overloads do. Exits 1 above the limit.

usage: tools/class_sizes.py [--most N]     the N largest, too
"""
import collections
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIMIT = 30
HEAD = re.compile(r"(?:class|struct)\s+(?:alignas\([^)]*\)\s*)?(?:\[\[[^\]]*\]\]\s*)?([\w:]+)(?:<[^<>]*>)?\s*(?:final\s*)?(?::(?!:)[^{;]*)?$")
NO_FUNCTION = re.compile(r"^\s*(?:using|typedef|friend|static_assert|enum|class|struct|union|namespace|extern)\b")


def without_comments(text: str) -> str:
    """Comments, strings, characters and lines of the preprocessor become nothing that holds a bracket."""
    text = re.sub(r'//[^\n]*|/\*.*?\*/|R"\((?:.*?)\)"|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])\'',
                  lambda m: "" if m.group(0).startswith("/") else "0", text, flags=re.DOTALL)
    return re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", "", text, flags=re.MULTILINE)


def without_templates(declaration: str) -> str:
    """`template <..>` and what requires something stand before a function; arguments in <> are no parameters."""
    declaration = declaration.strip()
    while (m := re.match(r"template\s*<", declaration)):
        depth, at = 1, m.end()
        while at < len(declaration) and depth > 0:
            depth += {"<": 1, ">": -1}.get(declaration[at], 0)
            at += 1
        declaration = declaration[at:].strip()
    previous = None
    while previous != declaration:
        previous, declaration = declaration, re.sub(r"<[^<>]*>", "", declaration)
    return re.sub(r"\b(?:alignas|decltype|noexcept|requires|__attribute__)\s*\([^()]*\)", "", declaration)


def function_of(declaration: str, owner: str) -> str | None:
    """The name of the function that is declared, if it counts."""
    plain = without_templates(re.sub(r"\[\[[^\]]*\]\]", "", declaration))
    if NO_FUNCTION.match(plain) or re.search(r"=\s*(?:delete|default)\s*$", plain):
        return None
    m = re.match(r"[^=({]*?([~\w]+)\s*\(", plain)
    if not m or "operator" in plain.split("(")[0]:
        return None
    return None if m.group(1).lstrip("~") == owner.split("::")[-1] else m.group(1)


def classes_of(text: str) -> dict[str, list[str]]:
    """Per class, its public functions."""
    found: dict[str, list[str]] = collections.defaultdict(list)
    scopes: list[list] = []  # of braces: [class or None, whether it is public here]
    declaration, parens = "", 0
    for token in re.findall(r"[{}();]|\b(?:public|private|protected)\s*:(?!:)|[^{}();]+?(?=[{}();]|\b(?:public|private|protected)\s*:(?!:)|$)",
                            without_comments(text), flags=re.DOTALL):
        here = scopes[-1] if scopes else None
        access = re.fullmatch(r"(public|private|protected)\s*:", token)
        if access and parens == 0:
            if here and here[0]:
                here[1] = access.group(1) == "public"
            declaration = ""
        elif token == "{" and parens == 0:
            head = HEAD.search(without_templates(declaration))
            if head:
                name = head.group(1)
                outer = next((s[0] for s in reversed(scopes) if s[0]), None)
                scopes.append([f"{outer}::{name}" if outer else name, re.search(r"\bstruct\b", declaration) is not None])
                found[scopes[-1][0]] += []
            else:
                if here and here[0] and here[1] and (name := function_of(declaration, here[0])):
                    found[here[0]].append(name)
                scopes.append([None, False])
            declaration = ""
        elif token == "}" and parens == 0:
            if scopes:
                scopes.pop()
            declaration = ""
        elif token == ";" and parens == 0:
            if here and here[0] and here[1] and (name := function_of(declaration, here[0])):
                found[here[0]].append(name)
            declaration = ""
        else:
            parens += {"(": 1, ")": -1}.get(token, 0)
            declaration += token
    return found


def self_test() -> None:
    found = classes_of("""
      namespace n { class A : public B<int> { int hidden(); public: A(); ~A(); explicit A(int a) : b_(a) {} // int no();
        int one() const { return f(1); } template <class T> std::vector<T> two(std::function<void(int)> g = {}); // public:
        std::function<void()> field; int number = f(2); View<const int> view{}; A& operator=(const A&) = delete;
        static constexpr int kTwo = twice(1); using F = void(int); friend bool same(A, A); virtual void four() = 0;
        struct Inner { int five() const; int x; private: void six(); }; Inner inner() const;
       private: int seven(); }; struct S { int eight(int a = f(3)) { if (a) { return 1; } return 2; } }; int free(int); }""")
    assert found["A"] == ["one", "two", "four", "inner"], found
    assert found["A::Inner"] == ["five"] and found["S"] == ["eight"], found


def main() -> int:
    self_test()
    headers = [h for folder in ("src", "include") for h in sorted((ROOT / folder).rglob("*.h"))]
    sizes = sorted(((len(functions), name, h.relative_to(ROOT)) for h in headers
                    for name, functions in classes_of(h.read_text()).items()), key=lambda s: (-s[0], s[1]))
    above = [s for s in sizes if s[0] > LIMIT]
    most = int(sys.argv[2]) if sys.argv[1:2] == ["--most"] else 0
    for count, name, header in sizes[:max(most, len(above))]:
        print(f"{header}: {name} has {count} public functions, at most {LIMIT}" if count > LIMIT else f"{header}: {name} has {count}")
    if not above:
        print(f"classes: {len(sizes)}, none with more than {LIMIT} public functions")
    return 1 if above else 0


if __name__ == "__main__":
    sys.exit(main())
