"""What a mutant is: one small change of one place in a C file, found by its tokens.

The operators, as in other tools for mutation testing:

  relation    <, <=, >, >= to the one beside it and to its opposite; == to != and back
  arithmetic  + to -, * to /, % to *, << to >>, & to |, and back; += to -= and the like; ++ to --; ^ to &
  unary       !x, -x, ~x to x
  logic       && to || and back; an operand of && or || left out
  condition   of an if, a while or a ?: to true and to false; and, where nothing else turns it round, to its negation
  constant    a number to 0 (0 to 1) and to one more, in code and in the #define of a constant; true to false and back
  return      a value to 0 and to one more, a bool to true and to false
  statement   a call, an assignment, a break or a continue left out
"""
import re
from dataclasses import dataclass

TOKEN = re.compile(r'''
    (?P<space>\s+|/\*.*?\*/)|(?P<directive>^[ \t]*\#(?:\\\n|/\*.*?\*/|[^\n])*)|(?P<text>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|
    (?P<number>\d[\w.]*)|(?P<word>[A-Za-z_]\w*)|
    (?P<sign><<=|>>=|\.\.\.|->|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%&|^<>=!~?:;,.(){}\[\]])''', re.S | re.M | re.X)
CONSTANT = re.compile(r'^[ \t]*#define[ \t]+\w+[ \t]+(?P<body>[^\n]*)')

RELATIONS = {'<': ('<=', '>='), '<=': ('<', '>'), '>': ('>=', '<='), '>=': ('>', '<'), '==': ('!=',), '!=': ('==',)}
ARITHMETIC = {'+': '-', '-': '+', '*': '/', '/': '*', '%': '*', '<<': '>>', '>>': '<<', '&': '|', '|': '&', '^': '&',
              '+=': '-=', '-=': '+=', '*=': '/=', '/=': '*=', '|=': '&=', '&=': '|=', '^=': '&=', '++': '--', '--': '++'}
LOGIC = {'&&': '||', '||': '&&', 'true': 'false', 'false': 'true'}
TYPES = {'const', 'static', 'inline', 'unsigned', 'signed', 'int', 'char', 'bool', 'void', 'struct', 'enum', 'union', 'typedef'}
CONTROL = {'if', 'else', 'for', 'while', 'do', 'switch', 'case', 'default', 'return', 'goto', 'sizeof', 'offsetof'}
OPENING, CLOSING = {'(': ')', '[': ']', '{': '}'}, {')', ']', '}'}


@dataclass(frozen=True)
class Mutant:
    file: str      # name
    function: str  # or '(file)' outside of every function
    before: str    # the lines that change, with single spaces
    after: str
    line: int
    start: int     # the change: text[start:end] becomes `to`
    end: int
    to: str

    @property
    def key(self):
        """Names it, wherever its function has moved to; the same line a second time in a function has '#2' behind it."""
        return self.file, self.function, self.before, self.after

    def apply(self, text):
        return text[:self.start] + self.to + text[self.end:]


class Source:
    def __init__(self, name, text):
        self.name, self.text = name, text
        self.tokens, at = [], 0
        self.constants = []  # places of numbers in #defines
        while at < len(text):
            found = TOKEN.match(text, at)
            if not found:
                raise ValueError(f'{name}: cannot read {text[at:at + 20]!r}')
            at = found.end()
            if found.lastgroup == 'directive':
                constant = CONSTANT.match(found.group())
                body = re.sub(r'/\*.*', '', constant.group('body')) if constant else ''
                offset = found.start() + (constant.start('body') if constant else 0)
                self.constants += [(offset + n.start(), offset + n.end()) for n in re.finditer(r'(?<![\w.])\d\w*(?![\w.])', body)]
            elif found.lastgroup != 'space':
                self.tokens.append((found.group(), found.start(), found.end()))
        self.words = [token[0] for token in self.tokens]
        self.pair = self.pairs()
        self.functions, self.types = self.find_functions()

    def pairs(self):
        pair, stack = {}, []
        for i, word in enumerate(self.words):
            if word in OPENING:
                stack.append(i)
            elif word in CLOSING:
                pair[i] = stack.pop()
                pair[pair[i]] = i
        return pair

    def find_functions(self):
        """For every token: the function that it is in, or ''; and what that returns."""
        functions, types = [''] * len(self.words), [''] * len(self.words)
        i = 0
        while i < len(self.words):
            if self.words[i] == '{' and self.words[i - 1] == ')':
                name = self.pair[i - 1] - 1
                kind = name
                while self.words[kind - 1] not in {';', '}'} and kind > 0:
                    kind -= 1
                for n in range(i, self.pair[i] + 1):
                    functions[n] = self.words[name]
                    types[n] = ' '.join(w for w in self.words[kind:name] if w not in {'static', 'inline', 'const'})
                i = self.pair[i]
            elif self.words[i] == '{':
                i = self.pair[i]
            i += 1
        return functions, types

    # -- What is what -------------------------------------------------------------------------------------------------

    def is_type(self, i):
        return self.words[i] in TYPES or bool(re.fullmatch(r'\w+_t', self.words[i])) or (
            i + 1 < len(self.words) and bool(re.fullmatch(r'[A-Za-z_]\w*', self.words[i])) and self.words[i] not in CONTROL and
            (bool(re.fullmatch(r'[A-Za-z_]\w*', self.words[i + 1])) or
             (self.words[i + 1] == '*' and self.words[i - 1] in {';', '{', '}', '(', ',', 'const', 'static'} and
              i + 3 < len(self.words) and self.words[i + 3] in {'=', ';', ',', ')', '['} and
              bool(re.fullmatch(r'[A-Za-z_]\w*', self.words[i + 2])))))

    def is_cast(self, close):
        inside = self.words[self.pair[close] + 1:close]
        return bool(inside) and self.words[self.pair[close] - 1] not in CONTROL and \
            not re.fullmatch(r'[A-Za-z_]\w*', self.words[self.pair[close] - 1]) and \
            all(w == '*' or w in TYPES or re.fullmatch(r'\w+_t|dr_\w+', w) for w in inside)

    def is_binary(self, i):
        before = self.words[i - 1]
        if before == ')':
            return not self.is_cast(i - 1) and self.words[self.pair[i - 1] - 1] not in CONTROL
        return before == ']' or (before[0].isalnum() or before[0] in '_"\'') and before not in CONTROL and not self.is_type(i - 1)

    def bounds(self, i, left, right):
        """The expression around token i, as far as one of these signs at its own depth: first and last token."""
        first = self.pair[i] if self.words[i] in CLOSING else i
        while self.words[first - 1] not in left and self.words[first - 1] not in OPENING:
            first = self.pair[first - 1] if self.words[first - 1] in CLOSING else first - 1
        last = self.pair[i] if self.words[i] in OPENING else i
        while self.words[last + 1] not in right and self.words[last + 1] not in CLOSING:
            last = self.pair[last + 1] if self.words[last + 1] in OPENING else last + 1
        return first, last

    ENDS = {'=', ',', ';', '?', ':', 'return', '+=', '-=', '|=', '&=', '^=', '*=', '/='}

    # -- The operators: (first character, behind the last, what takes its place) ----------------------------------------

    def changes(self, with_constants):
        for start, end in self.constants if with_constants else ():
            yield from self.of_number(start, end)
        for i, (word, start, end) in enumerate(self.tokens):
            if not self.functions[i] and not with_constants:
                continue
            if word[0].isdigit():
                yield from self.of_number(start, end)
            elif word in ('true', 'false'):
                yield start, end, LOGIC[word]
            elif not self.functions[i]:
                continue
            elif word in RELATIONS:
                yield from ((start, end, to) for to in RELATIONS[word])
            elif word in ('&&', '||'):
                yield start, end, LOGIC[word]
                yield from self.of_operands(i)
            elif word in ('!', '~'):
                yield start, end, ''
            elif word in ARITHMETIC:
                if word not in '+-*&' or self.is_binary(i):
                    yield start, end, ARITHMETIC[word]
                elif word == '-':
                    yield start, end, ''
            elif word in ('if', 'while') and self.words[i + 1] == '(':
                yield from self.of_condition(i + 2, self.pair[i + 1] - 1)
            elif word == '?':
                yield from self.of_condition(self.bounds(i - 1, self.ENDS, {'?'})[0], i - 1)
            elif word == 'return':
                yield from self.of_return(i)
            if self.functions[i] and self.begins_statement(i):
                stop = i
                while self.words[stop] != ';':
                    stop = self.pair[stop] + 1 if self.words[stop] in OPENING else stop + 1
                yield start, self.tokens[stop][2], ';'

    def of_number(self, start, end):
        number = self.text[start:end]
        value, suffix = re.fullmatch(r'(0[xX][0-9a-fA-F]+|\d+)(\w*)', number).groups()
        if int(value, 0) == 0:
            yield start, end, '1' + suffix
        else:
            yield start, end, '0' + suffix
            yield start, end, f'{int(value, 0) + 1:#x}{suffix}' if value.lower().startswith('0x') else f'{int(value) + 1}{suffix}'

    def of_operands(self, i):
        """`a && b` to `a` and to `b`. An operand of && ends at ||, one of || does not end at &&."""
        ends = self.ENDS | {'&&', '||'} if self.words[i] == '&&' else self.ENDS | {'||'}
        first, _ = self.bounds(i - 1, ends, ends)
        _, last = self.bounds(i + 1, ends, ends)
        yield self.tokens[first][1], self.tokens[i + 1][1], ''
        yield self.tokens[i - 1][2], self.tokens[last][2], ''

    def of_condition(self, first, last):
        start, end = self.tokens[first][1], self.tokens[last][2]
        yield start, end, 'true'
        yield start, end, 'false'
        depth, plain = 0, self.words[first] != '!'
        for i in range(first, last + 1):
            depth += (self.words[i] in OPENING) - (self.words[i] in CLOSING)
            plain = plain and not (depth == 0 and (self.words[i] in RELATIONS or self.words[i] in LOGIC))
        if plain:
            yield start, end, f'!({self.text[start:end]})'

    def of_return(self, i):
        if self.words[i + 1] == ';':
            return
        stop = i + 1
        while self.words[stop] != ';':
            stop = self.pair[stop] + 1 if self.words[stop] in OPENING else stop + 1
        start, end = self.tokens[i + 1][1], self.tokens[stop - 1][2]
        whole = self.text[start:end]
        if self.types[i] == 'bool':
            yield from ((start, end, to) for to in ('true', 'false') if to != whole)
        elif '*' in self.types[i]:
            yield start, end, '0'
        elif not re.fullmatch(r'\d\w*', whole):
            yield start, end, '0'
            yield start, end, f'({whole}) + 1'

    def begins_statement(self, i):
        before, word = self.words[i - 1], self.words[i]
        header = before == ')' and self.words[self.pair[i - 1] - 1] in {'if', 'for', 'while', 'switch'}
        label = before == ':' and self.label_ends(i - 1)
        if not (before in {';', '{', '}', 'else', 'do'} or header or label):
            return False
        if before == ';' and self.in_for(i) or before == '{' and not self.opens_block(i - 1):
            return False
        if word in {'break', 'continue'}:
            return True
        if word in CONTROL or word in OPENING and word != '(' or word in CLOSING or word == ';':
            return False
        return not self.is_type(i)

    def label_ends(self, colon):
        i = colon
        while self.words[i] not in {';', '{', '}', '?'}:
            if self.words[i] in {'case', 'default'}:
                return True
            i -= 1
        return False

    def in_for(self, i):
        """Is it in the brackets of a for?"""
        depth = 0
        while i > 0:
            i -= 1
            depth += (self.words[i] in CLOSING) - (self.words[i] in OPENING)
            if depth < 0:
                return self.words[i] == '('
        return False

    def opens_block(self, brace):
        before = self.words[brace - 1]
        if before != ')':
            return before in {';', '{', '}', 'else', 'do', ':'}
        return self.words[self.pair[brace - 1] - 1] in {'if', 'for', 'while', 'switch'} or not self.functions[brace - 1]


def mutants_of(name, text, with_constants=True):
    """All mutants of a file, in its order; with_constants: of what is outside of functions too."""
    source, seen, often = Source(name, text), {hash(text)}, {}
    function_at = {start: function for function, (_, start, _) in zip(source.functions, source.tokens)}
    found = []
    for start, end, to in source.changes(with_constants):
        mutated = hash(text[:start] + to + text[end:])
        if mutated in seen:
            continue
        seen.add(mutated)
        first, last = text.rfind('\n', 0, start) + 1, text.find('\n', end)
        before = ' '.join(text[first:last].split())
        after = ' '.join((text[first:start] + to + text[end:last]).split())
        found.append((start, end, to, function_at.get(start) or nearest(source, start), before, after))
    for start, end, to, function, before, after in sorted(found, key=lambda m: m[0]):
        count = often[function, before, after] = often.get((function, before, after), 0) + 1
        yield Mutant(name, (function or '(file)') + (f' #{count}' if count > 1 else ''), before, after,
                     text.count('\n', 0, start) + 1, start, end, to)


def nearest(source, start):
    """The function of a change that does not begin with a token."""
    inside = ''
    for function, (_, first, _) in zip(source.functions, source.tokens):
        if first > start:
            break
        inside = function
    return inside
