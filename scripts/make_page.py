#!/usr/bin/python3
"""Makes a page of HTML from a document of JSON on standard input; derail calls it.

  make_page.py TEMPLATE < document.json > page.html
  make_page.py --check TEMPLATE      says whether all that it needs is installed

TEMPLATE is the name of a file in derail_pages/templates without its ending.
Exit codes: 0 done, 1 something is missing.
"""

import os
import sys

sys.path.insert(
    0, os.path.dirname(os.path.realpath(__file__))
)  # a build runs this file from elsewhere

try:
    from derail_pages import page
except ImportError as e:
    print(f'make_page.py: {e}: pages need jinja2 (Debian: python3-jinja2)', file=sys.stderr)
    sys.exit(1)


def main(arguments):
    check = arguments[:1] == ['--check']
    if len(arguments) != 1 + check:
        print(__doc__, file=sys.stderr)
        return 1
    try:
        if check:
            page.check(arguments[1])
        else:
            sys.stdout.buffer.write(page.rendered(arguments[0], sys.stdin.buffer.read()).encode())
        return 0
    except ImportError as e:
        print(f'make_page.py: {e}: pages that replay a run need NumPy (Debian: python3-numpy)', file=sys.stderr)
        return 1
    except OSError as e:
        print(f'make_page.py: {e.filename}: {e.strerror}; {page.NEEDS}', file=sys.stderr)
        return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
